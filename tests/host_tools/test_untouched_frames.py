"""What the untouched simulated probes show: nothing under physical light, a shining face under the paper's."""

import dataclasses

import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.scenario import Scenario
from host_tools.phantom import Protocol, phantom_recording
from host_tools.untouched_frames import untouched_face


def test_the_physical_probe_is_dark_until_it_is_pressed(recording):
    face = untouched_face([recording])
    assert face.dark_counts == pytest.approx(4.0, abs=0.01)
    assert face.side_counts == pytest.approx((0.0,) * 4, abs=0.01)
    assert face.pressed_counts == pytest.approx(61.0, rel=0.1)
    assert (face.led_ratio, face.is_resolved) == (0.6, False)


def test_the_probe_of_the_papers_light_shines_untouched_and_a_tenth_of_it_is_plain(tables):
    linear, quick = Scenario(light="linear"), Protocol(frames=1)
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
