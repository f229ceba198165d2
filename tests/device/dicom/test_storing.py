"""What fails while others are taken is the object's; what fails with all others is the archive's, and only waits."""

import pytest
from stand_in_archive import ABORTS, TAKES
from written_exam import begin, measure

from device.dicom import storing
from device.dicom.association import archive_of
from device.dicom.delivery import Delivery
from device.errors import ArchiveUnreachable

pytestmark = pytest.mark.filterwarnings("ignore:.*<socket.socket:pytest.PytestUnraisableExceptionWarning")
MAY_PASS = (0x0110, 0x0124, 0x0213, 0xA700, 0xC000, ABORTS)


@pytest.fixture(autouse=True)
def _few_turns(monkeypatch):
    monkeypatch.setattr(storing, "MOST_FAILED_ALONE", 3)


@pytest.fixture
def deliver(archive, store, outgoing):
    settings = archive.settings()
    return Delivery(settings, archive_of(settings), store, outgoing).turn


@pytest.fixture
def uids(store, outgoing):
    """Four objects of an exam, queued."""
    exam = begin(store)
    for _ in range(2):
        measure(store, exam)
    outgoing.queue(exam["id"], version=1, by="Ada")
    return [row["uid"] for row in store.outbox.in_state("queued", limit=9)]


def states(store):
    return [row[0] for row in store._db.execute("SELECT state FROM outbox ORDER BY seq")]


def problem(store, uid):
    [row] = [one for state in ("queued", "refused", "sent") for one in store.outbox.in_state(state, limit=99)
             if one["uid"] == uid]  # fmt: skip
    return row["problem"]


@pytest.mark.parametrize("answer", MAY_PASS)
def test_an_archive_that_takes_nothing_for_a_while_gets_all_once_it_does(store, deliver, archive, uids, answer):
    archive.answers = lambda uid: answer
    for _ in range(storing.MOST_FAILED_ALONE + 1):
        with pytest.raises(ArchiveUnreachable, match="broke the connection off" if answer is ABORTS else "status 0x"):
            deliver()
    assert states(store) == ["queued"] * 4
    archive.answers = lambda uid: TAKES
    assert deliver() is False
    assert states(store) == ["confirmed"] * 4


@pytest.mark.parametrize("answer", MAY_PASS)
def test_what_fails_once_goes_again_in_the_next_turn(store, deliver, archive, uids, answer):
    archive.answers = lambda uid: answer if uid == uids[1] and archive.arrived.count(uid) == 1 else TAKES
    if answer in (0xA700, 0x0213):
        with pytest.raises(ArchiveUnreachable, match="has no room"):
            deliver()
    else:
        assert deliver() is True
    assert states(store) == ["confirmed", "queued", "confirmed", "confirmed"]
    assert deliver() is False
    assert states(store) == ["confirmed"] * 4


def test_a_note_that_fails_once_is_at_the_archive_after_the_next_turn(store, deliver, archive, uids):
    deliver()
    [void, _] = store.measurements(before_seq=2**62, limit=9)
    store.exams.void(void["id"], version=1, by="Ada", reason="Slipped")
    archive.answers = lambda uid: 0x0110
    with pytest.raises(ArchiveUnreachable, match="cannot process anything: status 0x0110"):
        deliver()
    archive.answers = lambda uid: TAKES
    assert deliver() is False
    assert sorted(states(store)) == ["confirmed"] * 4 + ["recalled"] * 2


@pytest.mark.parametrize("status", [0x0117, 0x0122, 0xA900])
def test_a_status_that_is_of_the_object_is_final(store, deliver, archive, uids, status):
    archive.answers = lambda uid: status if uid == uids[0] else TAKES
    assert deliver() is False
    assert states(store) == ["refused", "confirmed", "confirmed", "confirmed"]
    assert problem(store, uids[0]) == f"Status {status:#06x}."


def test_what_the_archive_says_it_has_already_is_asked_for(store, deliver, archive, uids):
    archive.kept = set(uids)
    archive.answers = lambda uid: 0x0111
    assert deliver() is False
    assert states(store) == ["confirmed"] * 4


@pytest.mark.parametrize("bad", [0, 1, 3])
@pytest.mark.parametrize("answer", [ABORTS, 0xC000])
def test_an_object_that_fails_while_others_pass_is_refused_and_named(store, deliver, archive, uids, bad, answer):
    archive.answers = lambda uid: answer if uid == uids[bad] else TAKES
    good = ["confirmed"] * 3
    for _ in range(storing.MOST_FAILED_ALONE - 1):
        assert deliver() is True
        assert [*states(store)[:bad], *states(store)[bad + 1 :]] == good
        assert states(store)[bad] == "queued"
    assert deliver() is False
    assert states(store)[bad] == "refused"
    assert uids[bad] in problem(store, uids[bad])
    assert f"in {storing.MOST_FAILED_ALONE} of {storing.MOST_FAILED_ALONE} turns" in problem(store, uids[bad])


def test_every_report_that_an_archive_cannot_bear_is_refused_and_every_image_is_there(store, deliver, archive, uids):
    """The last one fails behind all that are taken: it is not taken for an archive that went down."""
    archive.answers = lambda uid: ABORTS if uid in uids[1::2] else TAKES
    while deliver():
        assert len(archive.arrived) < 99
    assert states(store) == ["confirmed", "refused"] * 2


def test_an_archive_that_goes_down_amid_a_turn_counts_against_no_object(store, deliver, archive, uids):
    archive.answers = lambda uid: TAKES if len(archive.arrived) == 1 else 0x0110
    for _ in range(storing.MOST_FAILED_ALONE + 1):
        with pytest.raises(ArchiveUnreachable, match="status 0x0110"):
            deliver()
    assert states(store) == ["confirmed", "queued", "queued", "queued"]
    archive.answers = lambda uid: TAKES
    assert deliver() is False
    assert states(store) == ["confirmed"] * 4


def test_what_is_never_understood_is_refused_at_last_and_can_be_sent_again(
    store, outgoing, deliver, archive, uids, monkeypatch
):
    monkeypatch.setattr(storing, "MOST_NOT_UNDERSTOOD", 3)
    archive.answers = lambda uid: 0xC123
    for _ in range(3):
        assert states(store) == ["queued"] * 4
        with pytest.raises(ArchiveUnreachable, match="does not understand what it gets: status 0xc123"):
            deliver()
    assert states(store) == ["refused"] * 4
    assert "status 0xc123" in problem(store, uids[0])
    [exam] = {row["exam_id"] for row in store.outbox.in_state("refused", limit=9)}
    outgoing.queue(exam, version=1, by="Ada")
    with pytest.raises(ArchiveUnreachable):
        deliver()
    assert states(store) == ["queued"] * 4, "it is counted anew"


def test_more_bad_objects_than_end_a_turn_keep_no_good_one_waiting(store, outgoing, deliver, archive):
    exam = begin(store)
    for _ in range(4):
        measure(store, exam)
    outgoing.queue(exam["id"], version=1, by="Ada")
    uids = [row["uid"] for row in store.outbox.in_state("queued", limit=9)]
    bad = uids[: storing.FAILED_IN_A_ROW + 1]
    archive.answers = lambda uid: ABORTS if uid in bad else TAKES
    with pytest.raises(ArchiveUnreachable, match="broke the connection off"):
        deliver()
    assert archive.arrived == bad[:-1]
    assert deliver() is True
    assert states(store) == ["queued"] * 6 + ["confirmed"] * 2
    while deliver():
        assert len(archive.arrived) < 199
    assert states(store) == ["refused"] * 6 + ["confirmed"] * 2
