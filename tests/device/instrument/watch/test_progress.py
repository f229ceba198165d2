"""Progress on the clock of a test, which only moves while a part is used or a loop waits."""

import contextlib

import pytest

from device.errors import CameraError, CameraProcessError, LightError, ModelError
from device.hardware.camera_process import GRACE_S, KILL_TIMEOUT_S, START_TIMEOUT_S
from device.instrument.acquisition.bench import FRAME_TIMEOUT_S
from device.instrument.watch.progress import BEAT_S, PARTS, ProgressBoard
from device.instrument.watch.watchdog import WITHOUT_SYSTEMD_S

WATCHDOG_S = 10.0
"""The LED chip may be silent for 5 s, the load cell for 3 s, camera and inference for 20 s."""


class Clock:
    def __init__(self):
        self.now_s = 100.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def board(clock):
    return ProgressBoard(clock)


def use(board, clock, part, seconds=0.0, error=None):
    with contextlib.suppress(CameraError, LightError, ModelError), board.inside(part):
        clock.now_s += seconds
        if error:
            raise error


def stalled(board):
    stall = board.stall(WATCHDOG_S)
    return stall.parts if stall else ()


@pytest.mark.parametrize(
    ("part", "limit_s"), [("camera", 20.0), ("light", 5.0), ("force", 3.0), ("inference", 20.0), ("storage", 20.0)]
)
def test_a_part_is_stalled_after_its_own_time(board, clock, part, limit_s):
    clock.now_s += limit_s
    assert part not in stalled(board)
    clock.now_s += 0.01
    assert part in stalled(board)


@pytest.mark.parametrize("part", PARTS)
def test_a_part_that_is_used_goes_on_and_the_others_do_not_live_on_it(board, clock, part):
    for _ in range(21):
        clock.now_s += 1.0
        use(board, clock, part)
    assert set(stalled(board)) == set(PARTS) - {part}


@pytest.mark.parametrize("part", ["camera", "light", "inference"])
def test_the_part_in_which_a_loop_hangs_is_the_one_that_is_named(board, clock, part):
    """The others of its loop wait for it; the load cell has a loop of its own."""
    with board.inside(part):
        for _ in range(21):
            clock.now_s += 1.0
            use(board, clock, "force")
        assert stalled(board) == (part,)


def test_the_load_cells_loop_hangs_alone(board, clock):
    with board.inside("force"):
        for _ in range(21):
            clock.now_s += 1.0
            for part in ("camera", "light", "inference", "storage"):
                use(board, clock, part)
        assert stalled(board) == ("force",)


def test_the_time_of_an_estimate_is_not_held_against_camera_and_light(board, clock):
    """Nine seconds are in the inference's time and beyond the LED chip's; of the latter, four seconds have passed."""
    clock.now_s += 2.0
    use(board, clock, "inference", 9.0)
    use(board, clock, "force")
    assert stalled(board) == ()
    clock.now_s += 2.0
    assert board.stall(0.79 * WATCHDOG_S).silent_s == pytest.approx(4.0)


def test_a_fault_that_a_chip_answers_with_is_progress_but_a_camera_without_frames_is_not(board, clock):
    for _ in range(21):
        use(board, clock, "light", 0.1, LightError("No answer.", "Mend it."))
        use(board, clock, "inference", 0.1, ModelError("Wrong.", "Install it again."))
        use(board, clock, "camera", 1.0, CameraError("No frame.", "Mend it."))
        use(board, clock, "force")
    assert stalled(board) == ("camera",)
    assert board.stall(WATCHDOG_S).comes_back


def test_a_camera_whose_process_is_started_again_goes_on(board, clock):
    for _ in range(3):
        with contextlib.suppress(CameraProcessError), board.inside("camera"):
            clock.now_s += 20.0
            assert "camera" not in stalled(board)
            raise CameraProcessError("It did not answer.", "Wait.")
        assert "camera" not in stalled(board)


def test_the_camera_may_be_silent_for_as_long_as_its_process_takes_to_be_started_and_ended():
    longest_s = START_TIMEOUT_S + FRAME_TIMEOUT_S + GRACE_S + KILL_TIMEOUT_S
    assert longest_s < PARTS["camera"].limit_ratio * WITHOUT_SYSTEMD_S


def test_a_part_that_hangs_for_the_watchdogs_time_does_not_come_back(board, clock):
    with board.inside("light"):
        clock.now_s += 10.0
        assert board.stall(WATCHDOG_S).comes_back
        clock.now_s += 0.1
        assert not board.stall(WATCHDOG_S).comes_back


def test_a_stall_is_told_in_words(board, clock):
    use(board, clock, "inference", 15.0)
    clock.now_s += 20.25
    use(board, clock, "inference")
    use(board, clock, "force")
    assert str(board.stall(WATCHDOG_S)) == "the camera, the LED chip and the disk made no progress for 20.2 s"


def test_a_beat_exercises_what_has_been_idle_and_nothing_else(board, clock):
    used = []

    def exercise(part):
        return lambda: (used.append(part), use(board, clock, part))

    for part in ("camera", "light", "inference", "storage"):
        board.exercise(part, exercise(part))
    clock.now_s += BEAT_S
    use(board, clock, "camera")
    board.beat()
    board.beat()
    assert used == ["light", "inference", "storage"]


def test_a_fault_of_one_part_keeps_no_other_from_being_exercised(board, clock):
    def fail():
        raise CameraError("No frame.", "Mend it.")

    used = []
    board.exercise("camera", fail)
    board.exercise("light", lambda: used.append("light"))
    clock.now_s += BEAT_S
    with pytest.raises(CameraError):
        board.beat()
    assert used == ["light"]
