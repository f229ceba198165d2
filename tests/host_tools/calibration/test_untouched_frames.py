"""What the untouched simulated probes show: nothing under physical light, a shining face under the paper's."""

import dataclasses

import numpy as np
import pytest

from device.config import simulated_config
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.tactile_image import Frame
from device.measurement.recording.untouched_face import side_levels
from device.simulation.hand import BESIDE_MM
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.scenario import Scenario
from device.simulation.virtual_probe import VirtualProbe
from host_tools.calibration.certified_probe import untouched_face
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording


def test_the_physical_probe_is_dark_until_it_is_pressed(recording):
    face = untouched_face([recording])
    assert face.dark_counts == pytest.approx(4.0, abs=0.01)
    assert face.side_counts == pytest.approx((0.0,) * 4, abs=0.01)
    assert face.pressed_counts == pytest.approx(61.0, rel=0.1)
    assert (face.led_ratio, face.is_resolved) == (0.6, False)


def test_the_probe_of_the_papers_light_shines_untouched_and_a_tenth_of_it_is_plain(tables):
    linear, quick = Scenario(light="linear"), PhantomProtocol(frames=1)
    inclusion = Inclusion(10.0, 6.0, 80.0)
    presses = (phantom_recording(inclusion, tables, seed=i, protocol=quick, scenario=linear) for i in (1, 2))
    found = [untouched_face([press]) for press in presses]
    assert found[0].is_resolved
    assert found[0].side_counts == pytest.approx(found[1].side_counts, abs=0.01)
    assert found[0].spread_counts < 0.01


@pytest.mark.parametrize(
    ("roles", "words"), [(("reference", "press"), "dark frames"), (("dark", "press"), "lit unloaded frames")]
)
def test_without_dark_or_lit_frames_there_is_nothing_to_keep(recording, roles, words):
    frames = tuple(frame for frame in recording.frames if frame.role in roles)
    with pytest.raises(InvalidQuantity, match=words):
        untouched_face([dataclasses.replace(recording, frames=frames)])


def test_sides_that_are_trimmed_are_each_kept_with_their_own_brightness(recording):
    trimmed = (0.5, 0.6, 0.7, 0.6)
    frames = tuple(
        dataclasses.replace(frame, led_ratio=trimmed) if any(frame.led_ratio) else frame for frame in recording.frames
    )
    assert untouched_face([dataclasses.replace(recording, frames=frames)]).led_ratio == trimmed


@pytest.mark.parametrize(
    ("light", "force_n", "own"), [("linear", 0.0, (0.41, 0.37)), ("physical", 0.5, (0.366, 0.364))]
)
def test_the_quarter_next_to_a_side_gets_less_than_half_its_light_from_that_side(tables, light, force_n, own):
    """So light cannot be put at another brightness side by side: the other LEDs would be taken for this one."""
    camera = simulated_config().camera
    width_px, height_px = camera.raw_mode.sensor_px
    probe = VirtualProbe(Scenario(light=light), tables, (height_px, width_px), camera.sensor_scale)
    shares = np.array([quarters_of(probe, force_n, np.eye(4)[side]) for side in range(4)])
    np.testing.assert_allclose(shares.diagonal() / shares.sum(axis=0), [*own, *own], atol=0.006)


def quarters_of(probe, force_n, led_ratio):
    """Light [4] next to each side, in counts, without the camera's dark."""
    place = ProbePlacement(*BESIDE_MM, 0.0, 0.0)
    lit, dark = (
        Frame(
            probe.frame_counts(
                force_n=force_n, place=place, led_ratio=tuple(ratio), exposure_us=4000.0, gain=1.0, frame_number=1
            ),
            "reference", 0.0, force_n, tuple(ratio),
        )
        for ratio in (led_ratio, np.zeros(4))
    )  # fmt: skip
    return side_levels([lit])[0] - side_levels([dark])[0]
