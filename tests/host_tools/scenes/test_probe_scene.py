"""A probe's file as a scene: the design's changes nothing, what is its own is in the world, the rest is refused."""

from dataclasses import replace

import pytest

from device.files.toml_record import InvalidRecord, from_table
from device.simulation.physics.world import AS_BELIEVED
from device.simulation.scenario import Scenario
from host_tools.scenes.probe_file import simulated_probe
from host_tools.scenes.probe_scene import CUT, as_scene_table, scene_of_probe

DESIGN = simulated_probe()


def test_the_design_itself_is_the_scene_without_anything():
    assert scene_of_probe(DESIGN, DESIGN) == Scenario()
    assert as_scene_table(Scenario()) == {}


def test_what_is_its_own_is_in_the_world_and_comes_back_from_the_file():
    first, *others = DESIGN.layers
    camera = replace(DESIGN.camera, mm_per_px_y=1.01 * DESIGN.camera.mm_per_px_y, axis_x_mm=0.4, distortion_ratio=-0.02,
                     blur_px=1.1)  # fmt: skip
    own = replace(
        DESIGN,
        layers=(replace(first, youngs_modulus_kpa=66.0), *others),
        leds=replace(DESIGN.leds, imbalance_ratio=(0.1, -0.1, 0.0, 0.0)),
        camera=camera,
        cell=replace(DESIGN.cell, counts_per_n=102_000.0),
    )
    scene = scene_of_probe(own, DESIGN)
    assert scene.world.layers.face_modulus_ratio == 1.1
    assert scene.world.layers.middle_modulus_ratio == 1.0
    assert scene.world.light.side_ratio == (1.1, 0.9, 1.0, 1.0)
    assert (scene.world.camera.scale_x_ratio, scene.world.camera.scale_y_ratio) == (1.0, 1.01)
    assert (scene.world.camera.axis_x_mm, scene.world.camera.rim_distortion_percent) == (0.4, -2.0)
    assert (scene.world.cell_span_ratio, scene.lens.blur_px) == (1.02, 1.1)
    assert from_table(Scenario, as_scene_table(scene)) == scene


def test_a_number_draws_one_probe_within_the_tolerances_and_the_same_again():
    drawn = [scene_of_probe(DESIGN, DESIGN, number).world for number in (1, 2, 1)]
    assert drawn[0] == drawn[2] != drawn[1]
    assert AS_BELIEVED not in drawn
    modulus = DESIGN.layers[0]
    spread = modulus.youngs_modulus_kpa_tolerance / modulus.youngs_modulus_kpa
    ratios = [scene_of_probe(DESIGN, DESIGN, number).world.layers.face_modulus_ratio for number in range(1, 200)]
    assert max(abs(ratio - 1) for ratio in ratios) <= CUT * spread + 1e-4
    assert max(ratios) - min(ratios) > 3 * spread


def test_a_probe_of_other_dimensions_is_refused_with_all_of_them():
    own = replace(
        DESIGN,
        face=replace(DESIGN.face, radius_mm=10.0),
        block=replace(DESIGN.block, refractive_index=1.43),
        camera=replace(DESIGN.camera, bits=10),
    )
    with pytest.raises(InvalidRecord) as refused:
        scene_of_probe(own, DESIGN)
    assert [one.quantity for one in refused.value.problems] == ["radius_mm", "refractive_index", "camera.bits"]
    assert "docs/own_probe.md" in str(refused.value)
