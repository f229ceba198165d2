"""Parts are ready only when they were seen working just now; a fault of the hand or the place leaves them ready."""

import contextlib

import pytest

from device.errors import (
    AmbientLightError,
    CameraError,
    CameraProcessError,
    DarkSideError,
    DiskFullError,
    ExpiredCalibration,
    LateFrameError,
    LoadCellError,
    ModelError,
    StalledError,
    UnpluggedCellError,
    UnsteadyTareError,
)
from device.instrument.status import ProcedureStatus
from device.instrument.watch.progress import PARTS, ProgressBoard
from device.instrument.watch.readiness import BELIEVED_S, FRESH_S, KINDS, health_record, parts_health


class Clock:
    now_s = 100.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def progress(clock):
    return ProgressBoard(clock)


def use(progress, part, error=None):
    with contextlib.suppress(type(error) if error else ()), progress.inside(part):
        if error:
            raise error


def use_all(progress):
    for part in PARTS:
        use(progress, part)


def health(progress, fault=None, force_fault=None, stall=None):
    return parts_health(ProcedureStatus(fault=fault, stall=stall), progress, force_fault)


def unready(progress, **shown):
    return {name: one.code for name, one in health(progress, **shown).items() if not one.ready}


def test_nothing_is_ready_before_it_was_seen_working(progress):
    assert unready(progress) == dict.fromkeys(KINDS)
    use_all(progress)
    assert unready(progress) == {}


def test_what_was_not_seen_for_some_seconds_is_ready_no_more(progress, clock):
    use_all(progress)
    clock.now_s += FRESH_S
    assert unready(progress) == {}
    clock.now_s += 0.01
    assert set(unready(progress)) == set(KINDS)
    use(progress, "light")
    assert "light" not in unready(progress)


def test_a_stalled_part_has_the_stalls_code(progress, clock):
    use_all(progress)
    clock.now_s += 60.0
    assert set(unready(progress, stall=StalledError("It hangs.", "Wait.")).values()) == {"E901"}


def test_a_part_whose_loop_is_in_another_one_is_believed_for_a_while_and_that_one_is_not(progress, clock):
    """An estimate of mode precise takes its time; a camera that hangs is not ready at once."""
    use_all(progress)
    with progress.inside("camera"):
        clock.now_s += FRESH_S + 1.0
        use(progress, "force")
        assert set(unready(progress)) == {"camera"}
        clock.now_s += BELIEVED_S
        use(progress, "force")
        assert set(unready(progress)) == set(KINDS) - {"force"}


@pytest.mark.parametrize(
    ("part", "name", "error"),
    [
        ("camera", "camera", CameraError("No frame.", "Check.")),
        ("camera", "camera", CameraProcessError("It hangs.", "Wait.")),
        ("force", "force", LoadCellError("Silent.", "Check.")),
        ("inference", "answers", ModelError("Another answer.", "Reinstall.")),
        ("storage", "store", DiskFullError("Full.", "Free it.")),
    ],
)
def test_a_part_that_answers_with_a_fault_is_not_ready_until_it_works_again(progress, part, name, error):
    use_all(progress)
    use(progress, part, error)
    assert unready(progress) == {name: error.code}
    use(progress, part)
    assert unready(progress) == {}


@pytest.mark.parametrize(
    ("fault", "name"), [(DarkSideError("Dark.", "Mend."), "light"), (LateFrameError("Late.", "Mend."), "camera")]
)
def test_a_fault_that_only_the_procedure_sees_counts_as_long_as_it_is_shown(progress, fault, name):
    use_all(progress)
    assert unready(progress, fault=fault) == {name: fault.code}


@pytest.mark.parametrize(
    ("shown", "name", "code"),
    [
        ({"fault": AmbientLightError("Sun.", "Shade it.")}, "light", "E205"),
        ({"force_fault": UnsteadyTareError("Held.", "Lift it.")}, "force", "E308"),
    ],
)
def test_a_fault_of_the_hand_or_the_place_is_told_and_the_part_is_ready(progress, shown, name, code):
    use_all(progress)
    assert unready(progress, **shown) == {}
    assert health(progress, **shown)[name].code == code


def test_a_certificate_that_has_expired_is_no_matter_of_the_answers(progress):
    use_all(progress)
    assert unready(progress, fault=ExpiredCalibration("Over.", "Calibrate.")) == {}


def test_a_cell_that_is_at_fault_by_its_own_thread_is_not_ready(progress):
    use_all(progress)
    assert unready(progress, force_fault=UnpluggedCellError("Gone.", "Plug it in.")) == {"force": "E304"}


def test_the_record_is_what_an_updater_reads(progress):
    use_all(progress)
    parts = {name: {"ready": True, "code": None} for name in ("camera", "light", "force", "answers", "store")}
    assert health_record("0.2.0+412", health(progress)) == {"release": "0.2.0+412", "parts": parts}
