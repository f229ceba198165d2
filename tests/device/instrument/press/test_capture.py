"""Which frames count: a press is a list of forces here, one a frame, and time passes only from frame to frame."""

import sys
import types

import numpy as np
import pytest

from device.config import Config, LightSection, PressSection
from device.errors import AmbientLightError, DarkSideError, NoContrastError, TornFrameError
from device.instrument.acquisition.bench import DARK
from device.instrument.acquisition.light_budget import LightBudget
from device.instrument.press import capture as capture_module
from device.instrument.press.capture import AIR_FRAMES, UNLOADED_FRAMES, CalledAway, Capture, PressEnded
from device.instrument.press.machine import PressUnderWay
from device.instrument.press.states import Guidance, PressState
from device.instrument.status import StatusBoard
from device.measurement.mode import FRAMES, Frames
from device.measurement.recording.tactile_image import Frame

PRESS = PressSection(target_n=0.5, band_ratio=0.05, contact_n=0.05, overload_n=1.0, timeout_s=20.0)
LIGHT = LightSection(ratio=(0.1, 0.2, 0.3, 0.4))
CONFIG = Config(press=PRESS, light=LIGHT)
BLACK_COUNTS, COUNTS_PER_N = 4, 200
"""Of the scripted image: black, and what a newton adds under full light of all sides."""
FRAME_S = 1.0
"""So the number of a frame is also its time."""
HOLD, RAMP = Frames(3, is_ramp=False), Frames(5, is_ramp=True)
"""Frames of the modes "paper" and "standard" here; the ramp's targets are 0.08, 0.21, 0.34, 0.47 and 0.60 N."""


class ScriptedBench:
    """Gives one frame for each force of a script; a force of 'shaking' frames is not steady.

    Its force seems to change by `rate_n_per_s`. The image is as bright as light times force, each side alike; `dead`
    sides give none, `glow` counts come on top; `brighter` says by how much the frame of a number is. The lower half of
    a frame whose number is in `torn` shows the light of the frame before.
    """

    def __init__(self, forces, shaking=(), torn=(), dead=(), glow=0, rate_n_per_s=0.1, brighter=None):
        self.rate, self.brighter = rate_n_per_s, brighter or {}
        self.forces, self.shaking, self.torn = list(forces), set(shaking), set(torn)
        self.dead, self.glow, self.image_before = dead, glow, None
        self.taken, self.checks, self.lights, self.now_s = 0, 0, [], 0.0
        self.force = self
        self.budget = LightBudget()

    def light(self, ratio):
        self.lights.append(ratio)

    def check_lights(self):
        self.checks += 1
        self.light(DARK)

    def take(self, role):
        self.now_s += FRAME_S
        force_n, before = self.forces[min(self.taken, len(self.forces) - 1)], self.image_before
        self.force_n = force_n
        self.taken += 1
        image = self.image(force_n)
        counts, self.image_before = image.copy(), image
        if self.taken in self.torn:
            counts[8:] = before[8:]
        counts = np.minimum(np.rint(self.brighter.get(self.taken, 1.0) * counts), 255).astype(np.uint8)
        return Frame(counts, role, self.taken * FRAME_S, force_n, self.lights[-1])

    def image(self, force_n):
        light = sum(ratio for side, ratio in enumerate(self.lights[-1]) if side not in self.dead)
        return np.full((16, 16), BLACK_COUNTS + self.glow + round(light * force_n * COUNTS_PER_N), np.uint8)

    def range_n(self, t_s, *, around_line):
        return 1.0 if round(t_s / FRAME_S) in self.shaking else 0.0

    def peak_n(self, since_s, t_s):
        return self.force_n

    def rate_n_per_s(self, t_s):
        return self.rate

    @property
    def latest_n(self):
        return self.forces.pop(0)

    def pass_time(self, seconds):
        self.now_s += seconds


@pytest.fixture
def capture_of(monkeypatch):
    def capture(*forces, **troubles):
        monkeypatch.setitem(FRAMES, "paper", HOLD)
        monkeypatch.setitem(FRAMES, "standard", RAMP)
        bench = ScriptedBench(forces, **troubles)
        clock = types.SimpleNamespace(monotonic=lambda: bench.now_s, sleep=bench.pass_time)
        monkeypatch.setattr(capture_module, "time", clock)
        return Capture(bench, CONFIG, StatusBoard())

    return capture


def holding(capture):
    """Return the capture of a press whose frames are there."""
    capture.machine = PressUnderWay(PressState.HOLDING)
    return capture


def releasing(capture):
    """Return the capture of a press whose hand is to lift."""
    capture.machine = PressUnderWay(PressState.RELEASING)
    return capture


def times_of(frames):
    return [frame.t_s for frame in frames]


def test_only_frames_in_the_force_band_count(capture_of):
    """0.474 and 0.526 N are just outside 0.5 N +- 5 %."""
    frames = capture_of(0.0, 0.3, 0.5, 0.474, 0.475, 0.526, 0.525).loaded("press", "paper")
    assert times_of(frames) == [3, 5, 7]
    assert {frame.role for frame in frames} == {"press"}


def test_a_force_that_only_passes_through_the_band_does_not_count(capture_of):
    frames = capture_of(0.5, 0.5, 0.5, 0.5, 0.5, shaking=(1, 3)).loaded("press", "paper")
    assert times_of(frames) == [2, 4, 5]


def test_a_hand_that_lifts_early_begins_again(capture_of):
    frames = capture_of(0.5, 0.5, 0.04, 0.5, 0.5, 0.5).loaded("press", "paper")
    assert times_of(frames) == [4, 5, 6]


def test_a_hand_that_leaves_the_band_but_not_the_skin_keeps_its_frames(capture_of):
    frames = capture_of(0.5, 0.5, 0.06, 0.5).loaded("press", "paper")
    assert times_of(frames) == [1, 2, 4]


def test_a_ramp_takes_a_frame_at_each_of_its_forces_however_it_is_pressed(capture_of):
    """The hold's band plays no part, and the hand may go on growing."""
    frames = capture_of(0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6).loaded("press", "standard")
    assert [frame.force_n for frame in frames] == [0.1, 0.2, 0.3, 0.5, 0.6]


def test_a_reference_ramp_reaches_further_at_both_ends(capture_of):
    """To 0.06 and 0.62 N."""
    capture = capture_of(0.0, 0.06, 0.2, 0.34, 0.48, 0.61, 0.62)
    assert [frame.force_n for frame in capture.loaded("reference", "standard")] == [0.06, 0.2, 0.34, 0.48, 0.62]


def test_the_board_knows_at_which_forces_a_ramp_still_wants_frames(capture_of):
    capture, told = capture_of(0.0, 0.08, 0.21, 0.34, 0.47, 0.6), []
    capture.board.on_guidance(lambda guidance: told.append((guidance, capture.board.now.wanted_n)))
    capture.loaded("press", "standard")
    assert [guidance for guidance, _ in told] == [Guidance.TOUCH_LESION, Guidance.PRESS_SLOWLY, Guidance.HOLD_STILL]
    assert [len(wanted_n) for _, wanted_n in told] == [5, 4, 0]
    assert told[0][1] == pytest.approx((0.08, 0.21, 0.34, 0.47, 0.60))


def test_a_hand_that_lifts_in_a_ramp_begins_again(capture_of):
    frames = capture_of(0.1, 0.2, 0.3, 0.0, 0.08, 0.21, 0.34, 0.47, 0.6).loaded("press", "standard")
    assert times_of(frames) == [5, 6, 7, 8, 9]


RAMP_N = 0.08, 0.21, 0.34, 0.47, 0.6


def turned_ramp(capture_of, monkeypatch, *in_air, off_n=0.01, shaking=(), period_s=0.016):
    """Return the forces of a ramp on the lesion whose cell reads `off_n` more than presses, after frames `in_air`.

    These are (force that is read, force that presses); the image shows the latter. Shaking frames count from 1.
    """
    monkeypatch.setattr(sys.modules[__name__], "FRAME_S", period_s)
    before = 2 * UNLOADED_FRAMES + len(RAMP_N) + 1
    script = [*[0.0] * (2 * UNLOADED_FRAMES + 1), 0.0, 0.06, 0.2, 0.34, 0.48, 0.62]
    pressing = [*(pressed for _, pressed in in_air), *RAMP_N]
    read = [*(seen for seen, _ in in_air), *(off_n + one for one in RAMP_N)]
    capture = capture_of(*script, *read, shaking=[before + one for one in shaking])
    capture.unloaded()
    capture.loaded("reference", "standard")
    capture.machine = PressUnderWay()  # as once the hand has lifted
    dry, start = capture.bench.image, capture.bench.taken
    monkeypatch.setattr(capture.bench, "image", lambda _: dry(pressing[capture.bench.taken - start - 1]))
    return [frame.force_n for frame in capture.loaded("press", "standard")]


def test_forces_on_the_lesion_count_from_the_zero_that_the_reference_had(capture_of, monkeypatch):
    """The probe was turned between the two: in the air its cell reads otherwise, while the face stays dark."""
    found = turned_ramp(capture_of, monkeypatch, *[(0.01, 0.0)] * AIR_FRAMES)
    assert found == pytest.approx(RAMP_N)


@pytest.mark.parametrize(
    ("in_air", "more"),
    [
        ([(0.01, 0.0)] * (AIR_FRAMES - 1), {}),
        ([(0.01, 0.004)] * AIR_FRAMES, {}),
        ([(0.01, 0.0)] * AIR_FRAMES, {"shaking": range(1, AIR_FRAMES + 1)}),
        ([(0.03, 0.0)] * AIR_FRAMES + [(0.01, 0.0)] * 40, {"shaking": range(AIR_FRAMES + 1, AIR_FRAMES + 41)}),
    ],
    ids=["too short", "touching lightly", "shaking", "long before the touch"],
)
def test_forces_stay_as_they_are_read_where_the_zero_in_the_air_is_not_seen(capture_of, monkeypatch, in_air, more):
    """A face that rests lightly is bright, and what a probe reads before it is turned is no zero of after it."""
    found = turned_ramp(capture_of, monkeypatch, *in_air, **more)
    assert found == pytest.approx([0.01 + one for one in RAMP_N])


def test_a_ramp_that_is_too_fast_has_no_frames_and_the_operator_is_told(capture_of):
    capture, told = capture_of(0.1, 0.3, 0.6, 1.25, rate_n_per_s=0.36), []
    capture.board.on_guidance(told.append)
    with pytest.raises(PressEnded, match="rose to 1.25 N"):
        capture.loaded("press", "standard")
    assert told == [Guidance.TOUCH_LESION, Guidance.SLOWER]
    assert capture.board.now.frames_taken == 0


def test_a_ramp_that_goes_too_far_is_rejected(capture_of):
    with pytest.raises(PressEnded, match=r"rose to 1\.01 N, above 1\.00 N"):
        capture_of(0.1, 0.2, 1.01).loaded("press", "standard")


def test_a_ramp_that_never_comes_is_rejected_after_the_timeout(capture_of):
    with pytest.raises(PressEnded, match="No press came for 20 s"):
        capture_of(0.0).loaded("press", "standard")


@pytest.mark.parametrize(("flag", "state"), [("cancelled", "cancelled"), ("stopping", "failed")])
def test_a_ramp_that_is_cancelled_or_stopped_ends_in_the_middle(capture_of, flag, state):
    capture = capture_of(0.0, 0.1, 0.2)
    capture.board.on_guidance(lambda guidance: guidance is Guidance.PRESS_SLOWLY and getattr(capture, flag).set())
    with pytest.raises(PressEnded) as end:
        capture.loaded("press", "standard")
    assert end.value.state == state
    assert capture.bench.taken == 2


def test_a_ramp_whose_smallest_force_is_as_bright_as_its_largest_ends_the_press(capture_of, monkeypatch):
    capture = capture_of(0.08, 0.21, 0.34, 0.47, 0.6)
    dry = capture.bench.image
    monkeypatch.setattr(capture.bench, "image", lambda force_n: dry(0.5))
    with pytest.raises(NoContrastError):
        capture.loaded("press", "standard")


def test_the_screen_is_told_at_every_frame(capture_of):
    capture, told = capture_of(0.0, 0.3, 0.6, 0.5), []
    capture.board.on_guidance(told.append)
    capture.loaded("reference", "paper")
    assert told == [Guidance.PRESS_BESIDE, Guidance.PRESS_HARDER, Guidance.PRESS_LIGHTER, Guidance.HOLD_STILL]
    assert capture.board.now.frames_taken == 3


def test_frames_are_taken_under_the_configured_light(capture_of):
    frames = capture_of(0.5).loaded("press", "paper")
    assert {frame.led_ratio for frame in frames} == {(0.1, 0.2, 0.3, 0.4)}


def test_too_much_force_rejects_the_press_with_both_numbers(capture_of):
    with pytest.raises(PressEnded, match=r"rose to 1\.25 N, above 1\.00 N") as end:
        capture_of(0.5, 0.5, 1.25).loaded("press", "paper")
    assert end.value.state == "rejected"


def test_the_overload_itself_is_still_bearable(capture_of):
    assert len(capture_of(1.0, 0.5).loaded("press", "paper")) == 3


def test_a_press_that_never_comes_is_rejected_after_the_timeout(capture_of):
    """The 21st frame, a second each, is too late."""
    capture = capture_of(0.0)
    with pytest.raises(PressEnded, match="No press came for 20 s") as end:
        capture.loaded("press", "paper")
    assert end.value.state == "rejected"
    assert capture.bench.taken == 21


def test_the_time_counts_from_the_last_contact(capture_of):
    """15 frames without contact, one with, and 15 more: neither pause is too long."""
    forces = [0.0] * 15 + [0.3] + [0.0] * 15 + [0.5]
    assert len(capture_of(*forces).loaded("press", "paper")) == 3


@pytest.mark.parametrize(("flag", "state"), [("cancelled", "cancelled"), ("stopping", "failed")])
def test_a_press_that_is_cancelled_or_stopped_ends_before_the_next_frame(capture_of, flag, state):
    capture = capture_of(0.5)
    getattr(capture, flag).set()
    with pytest.raises(PressEnded) as end:
        capture.loaded("press", "paper")
    assert end.value.state == state
    assert end.value.reason
    assert capture.bench.taken == 0


def test_unloaded_frames_are_dark_then_lit_and_the_light_goes_off(capture_of):
    capture = capture_of(0.0, 0.01)
    frames = capture.unloaded()
    assert [frame.role for frame in frames] == ["dark"] * UNLOADED_FRAMES + ["reference"] * UNLOADED_FRAMES
    assert {frame.led_ratio for frame in frames if frame.role == "dark"} == {DARK}
    assert {frame.led_ratio for frame in frames if frame.role == "reference"} == {(0.1, 0.2, 0.3, 0.4)}
    assert capture.bench.lights[-1] == DARK


def test_unloaded_frames_are_lit_anew_for_another_brightness_only(capture_of):
    capture = capture_of(0.0, 0.0)
    frames = capture.unloaded()
    taken = capture.bench.taken
    assert capture.relit(frames, (0.1, 0.2, 0.3, 0.4)) == frames
    assert capture.bench.taken == taken
    relit = capture.relit(frames, (0.6, 0.6, 0.6, 0.6))
    assert [frame for frame in relit if frame.role == "dark"] == frames[:UNLOADED_FRAMES]
    assert [frame.led_ratio for frame in relit[UNLOADED_FRAMES:]] == [(0.6, 0.6, 0.6, 0.6)] * UNLOADED_FRAMES
    assert capture.bench.lights[-1] == DARK


def test_the_leds_currents_are_checked_with_the_unloaded_frames_and_before_each_press(capture_of):
    capture = capture_of(0.0, 0.0)
    capture.unloaded()
    assert capture.bench.checks == 1
    for role in ("reference", "press"):
        capture.bench.forces = [0.5]
        capture.loaded(role, "paper")
        capture.release()
    assert capture.bench.checks == 3


def test_unloaded_frames_wait_in_the_dark_until_the_probe_is_lifted(capture_of):
    """0.049 N, just below the threshold of contact, is the first that counts as lifted."""
    capture = capture_of(0.5, 0.2, 0.05, 0.049, 0.0)
    frames = capture.unloaded()
    assert capture.bench.lights[0] == DARK
    assert {frame.force_n for frame in frames} == {0.0}


def test_whoever_holds_the_probe_since_the_start_is_told_to_lift_it(capture_of):
    """Only then: after a press the screen says so by itself, or shows its result."""
    for shown, told in ((Guidance.WAIT, [Guidance.LIFT, Guidance.WAIT]), (Guidance.DONE, [])):
        capture, read = capture_of(0.5, 0.5, 0.0, 0.0), []
        capture.board.update(guidance=shown)
        capture.board.on_guidance(read.append)
        capture.unloaded()
        assert read == told


def test_unloaded_frames_that_were_touched_meanwhile_are_taken_again_and_the_operator_is_told_to_lift(capture_of):
    """A tap between two looks at the force: a flat field under load would be wrong in every pixel.

    And it is told until they are taken: a hand that presses whenever it is told to would touch each time before.
    """
    capture, peaks_n, told = capture_of(0.0, 0.0, 0.0), [0.3, 0.0], []
    capture.bench.peak_n = lambda since_s, t_s: peaks_n.pop(0)
    capture.board.on_guidance(lambda guidance: told.append((guidance, capture.bench.taken)))
    frames = capture.unloaded()
    assert capture.bench.taken == 4 * UNLOADED_FRAMES
    assert [frame.t_s for frame in frames] == list(range(2 * UNLOADED_FRAMES + 1, 4 * UNLOADED_FRAMES + 1))
    assert told == [(Guidance.LIFT, 2 * UNLOADED_FRAMES), (Guidance.WAIT, 4 * UNLOADED_FRAMES)]
    assert capture.bench.lights[-1] == DARK


def test_a_probe_that_is_never_lifted_does_not_keep_the_daemon_from_stopping(capture_of):
    capture = capture_of(0.5)
    capture.stopping.set()
    assert len(capture.unloaded()) == 2 * UNLOADED_FRAMES
    assert len(capture.bench.forces) == 1


def test_between_two_presses_the_light_is_off_until_the_probe_is_lifted(capture_of):
    capture = holding(capture_of(0.5, 0.2, 0.05, 0.049, 9.9))
    capture.release()
    capture.lifted()
    assert capture.bench.lights == [DARK]
    assert capture.bench.forces == [9.9]


def test_a_probe_that_is_not_lifted_between_two_presses_is_rejected_after_the_timeout(capture_of):
    """20 ms a poll: the timeout of 20 s is over at the 1001st."""
    capture = releasing(capture_of(*[0.5] * 2000))
    with pytest.raises(PressEnded, match="not lifted for 20 s") as end:
        capture.lifted()
    assert end.value.state == "rejected"
    assert 2000 - len(capture.bench.forces) == pytest.approx(1001, abs=1)


@pytest.mark.parametrize(("flag", "state"), [("cancelled", "cancelled"), ("stopping", "failed")])
def test_a_press_can_be_cancelled_or_stopped_before_the_probe_is_lifted(capture_of, flag, state):
    capture = releasing(capture_of(*[0.5] * 5))
    getattr(capture, flag).set()
    with pytest.raises(PressEnded) as end:
        capture.lifted()
    assert end.value.state == state


HELD = (0.5,)
"""A hand that holds the target."""
REFERENCE = [Frame(np.full((16, 16), 104, np.uint8), "reference", 0.0, 0.5, LIGHT.ratio)] * 3
"""What was taken of it under full light before."""


def test_each_side_is_lit_alone_after_a_dark_frame_while_the_hand_holds(capture_of):
    capture = holding(capture_of(*HELD))
    capture.side_levels(REFERENCE)
    alone = [tuple(ratio if side == number else 0.0 for side, ratio in enumerate(LIGHT.ratio)) for number in range(4)]
    assert capture.bench.lights == [DARK, *alone]


def test_a_sides_level_is_that_of_full_brightness_at_the_target_force(capture_of):
    """0.1 of 1.0 at 0.5 N are 10 counts above dark: 100 at full brightness."""
    assert holding(capture_of(0.5)).side_levels(REFERENCE) == pytest.approx((100.0,) * 4)


def test_a_side_that_is_looked_at_under_another_force_has_the_level_of_the_target_all_the_same(capture_of):
    """At 0.65 N 0.1 of 1.0 are 13 counts; the reference ramp tells that light is in proportion to the force."""
    capture = capture_of(*[0.0] * (1 + 2 * UNLOADED_FRAMES), 0.08, 0.21, 0.34, 0.47, 0.65)
    capture.unloaded()
    reference = capture.loaded("reference", "standard")
    assert capture.side_levels(reference) == pytest.approx((100.0,) * 4, rel=0.01)


def test_a_dead_side_is_named(capture_of):
    with pytest.raises(DarkSideError, match=r"No light from -x although"):
        holding(capture_of(*HELD, dead=(2,))).side_levels(REFERENCE)


def test_a_press_that_shows_no_light_at_all_ends_before_it_is_measured(capture_of):
    capture = capture_of(*[0.0] * (1 + 2 * UNLOADED_FRAMES), 0.5, dead=(0, 1, 2, 3))
    capture.unloaded()
    with pytest.raises(DarkSideError, match="No light from any side although all are switched on: 0.0 counts"):
        capture.loaded("press", "paper")


def test_light_that_is_there_while_all_sides_are_off_is_seen_untouched_and_under_load(capture_of):
    with pytest.raises(AmbientLightError):
        capture_of(0.0, 0.0, glow=40).unloaded()
    with pytest.raises(AmbientLightError):
        holding(capture_of(*HELD, glow=40)).side_levels(REFERENCE)


def test_a_hand_that_lifts_before_the_light_is_checked_is_told_to_hold(capture_of):
    with pytest.raises(PressEnded, match="lifted too early") as end:
        holding(capture_of(0.5, 0.5, 0.3)).side_levels(REFERENCE)
    assert end.value.state == "rejected"


def test_an_image_that_is_as_bright_at_a_touch_as_in_the_hold_ends_the_press(capture_of, monkeypatch):
    """As with gel: 0.1 N looks like 0.5 N."""
    capture = capture_of(0.1, 0.5)
    dry = capture.bench.image
    monkeypatch.setattr(capture.bench, "image", lambda force_n: dry(0.5))
    with pytest.raises(NoContrastError):
        capture.loaded("press", "paper")


def test_a_press_whose_way_to_the_hold_was_not_seen_is_not_judged_by_its_contrast(capture_of, monkeypatch):
    """0.4 N is above 0.7 of the target: too near to the hold to tell."""
    capture = capture_of(0.4, 0.5)
    monkeypatch.setattr(capture.bench, "image", lambda force_n: np.full((16, 16), 90, np.uint8))
    assert len(capture.loaded("press", "paper")) == 3


def test_a_saturated_frame_is_taken_again_and_too_many_end_the_press(capture_of):
    assert times_of(capture_of(0.1, 0.5, brighter={3: 9.0, 4: 9.0}).loaded("press", "paper")) == [2, 5, 6]
    with pytest.raises(PressEnded, match=r"100.0% of its pixels are saturated, above 0.1%: shade .* lower light.ratio"):
        capture_of(0.1, 0.5, brighter=dict.fromkeys(range(3, 99), 9.0)).loaded("press", "paper")


def test_a_frame_of_a_hold_that_is_unlike_the_others_is_taken_again(capture_of, monkeypatch):
    capture = capture_of(0.1, 0.5, brighter={4: 1.3})
    monkeypatch.setitem(FRAMES, "paper", Frames(6, is_ramp=False))
    assert times_of(capture.loaded("press", "paper")) == [2, 3, 5, 6, 7, 8]
    assert capture.machine.replaced == 1


def test_a_hold_in_which_frames_are_unlike_the_others_again_and_again_is_rejected(capture_of, monkeypatch):
    """Every second frame; the five that may be taken again are not enough."""
    capture = capture_of(0.1, 0.5, brighter=dict.fromkeys(range(4, 99, 2), 1.3))
    monkeypatch.setitem(FRAMES, "paper", Frames(10, is_ramp=False))
    with pytest.raises(PressEnded, match="More than 5 frames were unlike the others, the last by 30%: shade"):
        capture.loaded("press", "paper")


WAYS = {
    PressState.APPROACH: (0.0,),
    PressState.TOO_LIGHT: (0.3,),
    PressState.TOO_HARD: (0.7,),
    PressState.HOLDING: (0.5,),
    PressState.UNSTEADY: (0.5,) * 3,
    PressState.CAPTURING: (0.0, 0.5),
}
"""Forces by which a press comes to each state; in `HOLDING` and `UNSTEADY` the hand shakes."""


@pytest.mark.parametrize("state", WAYS, ids=lambda state: state.code)
def test_a_press_is_cancelled_in_whatever_state_it_is(capture_of, state):
    shaking = range(1, 9) if state in (PressState.HOLDING, PressState.UNSTEADY) else ()
    capture, seen = capture_of(*WAYS[state], shaking=shaking), []
    take = capture.bench.take

    def take_and_cancel(role):
        seen.append(capture.machine.state)
        if seen[-1] is state and capture.bench.taken:
            capture.cancelled.set()
        return take(role)

    capture.bench.take = take_and_cancel
    with pytest.raises(PressEnded, match="Cancelled by the operator") as end:
        capture.loaded("press", "paper")
    assert (end.value.state, capture.machine.state) == ("cancelled", PressState.REJECTED)
    assert capture.board.now.state is PressState.REJECTED
    assert state in seen


def test_the_board_tells_every_state_of_a_press(capture_of):
    capture, told = capture_of(0.0, 0.3, 0.7, 0.5), []
    update = capture.board.update
    capture.board.update = lambda **changes: (
        told.append(changes["state"].code) if "state" in changes else update(**changes)
    )
    capture.loaded("press", "paper")
    assert told == ["approach", "approach", "too_light", "too_hard", *["capturing"] * 3, "holding"]


def test_a_torn_frame_and_its_neighbour_are_taken_again(capture_of):
    """Frame 5 is the first with light, and half of it is still dark."""
    capture = capture_of(0.0, 0.1, torn=(5,))
    capture.bench.peak_n = lambda since_s, t_s: 0.0
    frames = capture.unloaded()
    assert [frame.t_s for frame in frames if frame.role == "reference"] == [7, 8, 9, 10]
    assert {frame.counts.min() for frame in frames if frame.role == "reference"} == {24}


def test_a_camera_whose_every_frame_is_torn_is_at_fault(capture_of):
    with pytest.raises(TornFrameError):
        holding(capture_of(0.9, torn=range(2, 100))).side_levels(REFERENCE)


def test_the_wait_for_an_untouched_probe_can_be_given_up(capture_of):
    """A load cell whose zero has moved looks touched for ever: the self-test must still begin."""
    capture = capture_of(0.1, 0.1, 0.1)
    capture.called_away.set()
    with pytest.raises(CalledAway):
        capture.unloaded()
    assert capture.bench.taken == 0
