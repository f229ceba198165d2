"""A journal holds every row once, goes on after a crash, and is never mistaken for another one."""

import pytest

from device.measurement.quantities import InvalidQuantity
from host_tools.data.journal import Journal
from host_tools.data.plan import SweepPlan

PLAN = SweepPlan(5, 1).as_record()


def test_a_journal_of_another_sweep_is_not_continued(tmp_path):
    Journal(tmp_path / "j", PLAN).close()
    with pytest.raises(InvalidQuantity, match="another one"):
        Journal(tmp_path / "j", SweepPlan(5, 2).as_record())


def test_a_journal_of_another_sweep_is_given_up_where_that_was_asked_for_and_its_own_goes_on(tmp_path):
    other = SweepPlan(5, 2).as_record()
    for plan in (PLAN, other):
        journal = Journal(tmp_path / "j", plan, replace=True)
        assert len(journal) == 0
        journal.append({"index": 3})
        journal.close()
    again = Journal(tmp_path / "j", other, replace=True)
    assert 3 in again
    again.close()


def test_rows_of_two_solvers_are_never_mixed(tmp_path):
    """An update between a command that was interrupted and the one that goes on."""
    Journal(tmp_path / "j", PLAN, software={"software": "0.1.0", "software_sha256": "aa"}).close()
    other = {"software": "0.2.0", "software_sha256": "bb"}
    with pytest.raises(
        InvalidQuantity, match=r"software is 0\.1\.0 of sources aa, by which .*, but must be 0\.2\.0 of"
    ):
        Journal(tmp_path / "j", PLAN, software=other)
    Journal(tmp_path / "old", PLAN).close()
    with pytest.raises(InvalidQuantity, match="software is one that did not say which it is"):
        Journal(tmp_path / "old", PLAN, software=other)
    begun_anew = Journal(tmp_path / "j", PLAN, software=other, replace=True)
    begun_anew.close()
    assert (len(begun_anew), begun_anew.software) == (0, other)


def test_a_garbled_journal_is_refused_and_left_as_it_is(tmp_path):
    (tmp_path / "j").write_bytes(b"no journal\nat all\n")
    with pytest.raises(InvalidQuantity, match="lines of JSON"):
        Journal(tmp_path / "j", PLAN)
    assert (tmp_path / "j").read_bytes() == b"no journal\nat all\n"


def test_rows_come_back_in_order_and_once_after_a_torn_line(tmp_path):
    journal = Journal(tmp_path / "j", PLAN)
    assert [journal.append({"index": i, "value": i * i}) for i in (3, 1, 3, 0)] == [True, True, False, True]
    journal.close()
    with (tmp_path / "j").open("ab") as file:
        file.write(b'{"index": 2, "val')
    again = Journal(tmp_path / "j", PLAN)
    assert again.append({"index": 2, "value": 4})
    again.close()
    assert list(again.in_order()) == [{"index": i, "value": i * i} for i in range(4)]


def test_a_plan_torn_by_a_crash_is_written_again(tmp_path):
    (tmp_path / "j").write_bytes(b'{"schema": "tsis')
    journal = Journal(tmp_path / "j", PLAN)
    journal.append({"index": 0})
    journal.close()
    assert list(journal.in_order()) == [{"index": 0}]
    assert (tmp_path / "j").read_bytes().count(b"\n") == 2
