"""Things that differ are told apart, differ in what they say alone, and can be pressed by the simulated probe."""

from dataclasses import fields
from math import hypot

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.simulation.physics.slab import NOMINAL
from device.simulation.physics.world import AS_BELIEVED
from host_tools.scores.one_thing.causes import NOTHING, causes, relaxing, stiff_below

ALL = [*causes(), relaxing(10), stiff_below(2.0)]


def worlds_of(cause, seed=1):
    return cause.worlds(np.random.default_rng(seed))


def different(world):
    return [one.name for one in fields(world) if getattr(world, one.name) != getattr(AS_BELIEVED, one.name)]


def test_names_are_of_one_thing_each_and_the_first_is_that_nothing_differs():
    names = [cause.name for cause in ALL]
    assert len(set(names)) == len(names)
    assert worlds_of(causes()[0]) == (AS_BELIEVED, AS_BELIEVED)


@pytest.mark.parametrize("cause", [one for one in ALL if one is not NOTHING], ids=lambda cause: cause.name)
def test_a_world_differs_in_one_part_alone(tables, cause):
    for world in worlds_of(cause):
        assert len(different(world)) == 1
        assert np.isfinite(tables.ramps(Inclusion(8.0, 6.0, 60.0), NOMINAL, world).baseline.fields_per_n).all()


def test_presses_of_a_scan_lean_alike_far_each_in_a_direction_of_its_own():
    (tilted,) = [cause for cause in ALL if cause.name == "tilt on the lesion 0.5 degrees"]
    first, second = (world.tilt for world in worlds_of(tilted))
    assert hypot(first.lesion_x_deg, first.lesion_y_deg) == pytest.approx(0.5)
    assert hypot(second.lesion_x_deg, second.lesion_y_deg) == pytest.approx(0.5)
    assert first != second
    assert first.beside_x_deg == 0.0


def test_any_side_dims_and_any_patch_of_skin_is_pressed_the_same_within_a_scan():
    for part in ("light", "texture"):
        (cause,) = [one for one in ALL if one.name.startswith(("one LED", "texture of skin, 2 mm 1"))
                    and different(worlds_of(one)[0]) == [part]]  # fmt: skip
        drawn = [worlds_of(cause, seed) for seed in range(12)]
        assert all(first == second for first, second in drawn)
        assert len({str(first) for first, _ in drawn}) > 2


def test_what_phantoms_tell_is_the_same_in_every_press():
    for cause in ALL:
        if cause.owner in ("probe", "camera"):
            assert worlds_of(cause, 1) == worlds_of(cause, 2) == (cause.probe, cause.probe)
