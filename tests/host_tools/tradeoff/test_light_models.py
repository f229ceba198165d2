"""Coarser light tables are means of the committed one, and still tables."""

from __future__ import annotations

import numpy as np
import pytest

from device.files.shipped import SIMULATED_PROBE
from device.simulation.physics.light_table import LightTable, load_light_table
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.skin import Skin
from host_tools.tradeoff.light_models import coarser, fewer_heights


@pytest.fixture(scope="module")
def table() -> LightTable:
    return load_light_table(SIMULATED_PROBE)


def brightness(table: LightTable) -> float:
    """Return the mean radiance of a flat face evenly pressed."""
    lookup = LookupOptics(table)
    flat = np.zeros((len(lookup.x_mm),) * 2, np.float32)
    return float(lookup.radiance(flat, flat + 2, (1.0, 1.0, 1.0, 1.0), Skin()).mean())


def test_a_cell_of_a_coarser_table_is_the_mean_of_those_it_is_made_of(table: LightTable) -> None:
    coarse = coarser(table, 4)
    assert coarse.stray.shape[-1] == table.stray.shape[-1] // 4
    assert coarse.stray[0, 1, 2] == pytest.approx(table.stray[0, 4:8, 8:12].mean(), rel=1e-5)
    assert coarse.relative_irradiance.dtype == table.relative_irradiance.dtype


@pytest.mark.parametrize("times", [2, 8])
def test_a_coarser_table_gives_the_same_light_of_a_flat_face(table: LightTable, times: int) -> None:
    assert brightness(coarser(table, times)) == pytest.approx(brightness(table), rel=0.02)


def test_a_table_of_fewer_heights_keeps_the_flat_face_among_them(table: LightTable) -> None:
    few = fewer_heights(table, 2)
    assert few.depths_mm.tolist() == table.depths_mm[::2].tolist()
    assert len(few.half_angle[0]) == len(few.depths_mm) == len(few.relative_irradiance[0, 0])
    assert brightness(few) == pytest.approx(brightness(table), rel=0.02)
