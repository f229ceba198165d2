"""A probe: what cannot be built is refused, and what tables depend on has one hash."""

from dataclasses import replace

import pytest

from device.files.toml_record import InvalidRecord
from device.measurement.quantities import InvalidQuantity
from host_tools.scenes.probe_file import simulated_probe

PROBE = simulated_probe()


def part(name, **changes):
    """Return the simulated probe with one of its parts changed."""
    return replace(PROBE, **{name: replace(getattr(PROBE, name), **changes)})


def layer(place, **changes):
    layers = list(PROBE.layers)
    layers[place] = replace(layers[place], **changes)
    return replace(PROBE, layers=tuple(layers))


def narrow(half_width_mm):
    leds = replace(PROBE.leds, distance_mm=half_width_mm)
    return replace(PROBE, block=replace(PROBE.block, half_width_mm=half_width_mm), leds=leds)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: layer(1, thickness_mm=4.0), "sum of layers thickness_mm is 11 mm, but must be within 0.4 mm"),
        (lambda: layer(2, poisson_ratio=0.45), "poisson_ratio of the layers is 0.45 and 0.49"),
        (lambda: layer(0, youngs_modulus_kpa_tolerance=60.0), "must be below layers[0].youngs_modulus_kpa of 60"),
        (lambda: narrow(10.9), "face.radius_mm is 11.0, but must be at most block.half_width_mm of 10.9 mm"),
        (lambda: part("face", dome_mm=1.5), "at most half of layers[0].thickness_mm of 2 mm"),
        (lambda: part("leds", height_mm=9.5), "leds.height_mm is 9.5, but must be at least 0.75 and at most 9.25 mm"),
        (lambda: part("leds", height_mm=0.5), "keep the whole LED on the block's wall"),
        (lambda: part("leds", distance_mm=14.0), "leds.distance_mm is 14.0, but must be within 0.34 mm"),
        (lambda: part("leds", imbalance_ratio=(0.1, 0.0, 0.0, 0.0)), "mean of leds.imbalance_ratio is 0.025"),
        (lambda: part("camera", aperture_radius_mm=12.0), "camera.aperture_radius_mm is 12.0"),
        (lambda: part("camera", distance_mm=1.0), "must be above block.glass_thickness_mm of 1 mm"),
        (lambda: part("camera", mm_per_px_x=0.028), "longer side of the camera's window is 21.5 mm"),
        (lambda: part("camera", axis_y_mm=-1.0), "shorter side of the camera's window is 15.9 mm"),
        (lambda: part("camera", mm_per_px_y_tolerance=0.05), "below camera.mm_per_px_y of 0.03646"),
        (lambda: part("cell", counts_per_n_tolerance=2e5), "below cell.counts_per_n of 100000"),
        (lambda: replace(PROBE, layers=()), "layers is none, but must be at least one"),
    ],
)
def test_what_cannot_be_built_is_refused(build, words):
    with pytest.raises(InvalidQuantity) as refused:
        build()
    assert words in str(refused.value)
    assert len(getattr(refused.value, "problems", [refused.value])) == 1


def test_lengths_that_differ_by_their_tolerances_fit():
    assert layer(1, thickness_mm=3.3).waveguide.layer_thicknesses_mm == (2.0, 3.3, 5.0)
    assert part("leds", distance_mm=12.3).light_block.half_width_mm == 12.0


def test_all_that_cannot_be_built_is_told_at_once():
    with pytest.raises(InvalidRecord) as refused:
        replace(PROBE, face=replace(PROBE.face, radius_mm=13.0), leds=replace(PROBE.leds, height_mm=0.3))
    quantities = [problem.quantity for problem in refused.value.problems]
    sides = [f"{side} side of the camera's window" for side in ("longer", "shorter")]
    assert quantities == ["face.radius_mm", "leds.height_mm", *sides]


def test_an_axis_as_far_off_as_cameras_are_mounted_is_no_reason_to_refuse():
    """Two standard deviations of the shipped tolerance, on the paper's frame."""
    geometry = part("camera", axis_y_mm=0.6, distortion_ratio=-0.02).geometry
    assert (geometry.axis_y_mm, geometry.rim_distortion_percent, geometry.scale) == (0.6, -2.0, PROBE.scale)


@pytest.mark.parametrize(
    "changed",
    [
        replace(PROBE, serial="TSIS-0007"),
        layer(0, youngs_modulus_kpa_tolerance=1.0),
        part("camera", mm_per_px_x=0.0315, axis_x_mm=0.1),
        part("cell", counts_per_n=98_000.0),
    ],
)
def test_what_changes_no_table_changes_no_hash(changed):
    assert changed.sha256 == PROBE.sha256


@pytest.mark.parametrize(
    "changed",
    [
        layer(0, youngs_modulus_kpa=66.0),
        part("face", radius_mm=10.9),
        part("block", refractive_index=1.42),
        part("leds", lens_exponent=1.5),
        part("camera", aperture_radius_mm=1.9),
    ],
)
def test_what_a_table_is_computed_from_changes_the_hash(changed):
    assert changed.sha256 != PROBE.sha256
