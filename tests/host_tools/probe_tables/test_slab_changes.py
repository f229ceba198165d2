"""What other tissue changes: scattered slabs that hold their inclusions, followed as far as they go, fitted exactly."""

import numpy as np
import pytest

from device.measurement.parameters import ABOVE_BASE_MM
from device.measurement.quantities import Inclusion
from device.simulation.physics.chebyshev import points_with_ends
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL, PEOPLES_KPA, PEOPLES_MM, Slab
from device.simulation.physics.slab_changes import field_shapes
from host_tools.forward.press_model import PressFailed
from host_tools.probe_tables import slab_changes as module
from host_tools.probe_tables.force_ramps import FORCES_N
from host_tools.probe_tables.slab_changes import (
    APART_MM,
    HIGHEST,
    MODULI_KPA,
    PLACES,
    REACHES,
    SLAB_FORCES_N,
    SLABS_A_PLACE,
    THICKNESSES_MM,
    WITHOUT_INCLUSION,
    NominalTable,
    SlabRows,
    as_rows,
    assembled,
    inclusion_in_slabs,
    scattered,
    slab_change_per_n,
    terms_of_shapes,
)
from host_tools.scenes.scene import Waveguide

MISMATCHES = np.array([0.1, 0.5, 0.96])
R = 4


def test_every_slab_holds_its_inclusion_and_its_mesh_has_no_thin_layers():
    for one in scattered():
        assert one.slabs[0] == NOMINAL
        assert len(one.slabs) == 1 + SLABS_A_PLACE
        assert one.thicknesses_mm[0] >= one.size_mm + one.depth_mm + ABOVE_BASE_MM - 1e-9
        assert (np.diff(one.thicknesses_mm) >= APART_MM - 1e-9).all()


def test_scattered_slabs_reach_the_ends_of_what_people_have():
    slabs = [slab for one in scattered() for slab in one.slabs]
    moduli, thicknesses = (
        np.array(part) for part in zip(*((s.youngs_modulus_kpa, s.thickness_mm) for s in slabs), strict=True)
    )
    assert moduli.min() < 1.01 * PEOPLES_KPA[0]
    assert moduli.max() > 0.99 * PEOPLES_KPA[1]
    assert thicknesses.min() < 1.02 * PEOPLES_MM[0]
    assert thicknesses.max() > 0.98 * PEOPLES_MM[1]


def test_fewer_places_are_the_first_of_more():
    assert scattered(16) == scattered(64)[:16]


def test_there_are_more_slabs_than_terms_of_a_share_at_one_force_and_mismatch():
    """Of each slab, fields at many radii, three mismatches and five forces tell the shares of all shapes."""
    degrees, of_shape = terms_of_shapes(REACHES, HIGHEST)
    at_one = of_shape[0] & ~degrees[:, 4:].any(axis=1)
    assert 3 * at_one.sum() < PLACES * SLABS_A_PLACE
    assert degrees[:, 2:4].any(axis=1).all()  # a term of the inclusion alone changes nothing
    for reach, wanted in zip(REACHES, of_shape, strict=True):
        assert ((degrees[wanted] / np.array(reach)).sum(axis=1) < 1 + 1e-6).all()


def test_forces_that_are_not_reached_are_no_rows():
    one = next(one for one in scattered(64) if one.slabs[1].youngs_modulus_kpa < 2.1)
    rows = solved_on_paper(one, nominal_table().shapes(one))
    soft = sum(slab.youngs_modulus_kpa < 2.1 for slab in one.slabs[1:])
    assert len(rows.at) == len(MISMATCHES) * (SLABS_A_PLACE * len(SLAB_FORCES_N) - 2 * soft)
    assert np.isfinite(rows.changes).all()
    assert rows.changes.shape[1:] == (2, R)
    assert rows.shapes.shape[1:] == (5, 2, R)


def test_soft_tissue_is_followed_as_far_as_it_goes(monkeypatch):
    one, tried = scattered(1)[0], []

    def folds(scene_of, slab, levels, size_mm, depth_mm, mismatches, forces_n):
        tried.append((slab, len(forces_n)))
        if slab == one.slabs[1] and len(forces_n) > 3:
            raise PressFailed("the contact folded")
        return np.ones((len(mismatches), 2, len(forces_n), R))

    monkeypatch.setattr(module, "inclusions_per_n_mm3", folds)
    found = inclusion_in_slabs(one, MISMATCHES, Waveguide())
    assert found.shape == (1 + SLABS_A_PLACE, 3, 2, len(SLAB_FORCES_N), R)
    assert np.isnan(found[1, :, :, 3:]).all()
    assert np.isfinite(found[1, :, :, :3]).all()
    assert np.isfinite(np.delete(found, 1, axis=0)).all()
    assert [forces for slab, forces in tried if slab == one.slabs[1]] == [5, 4, 3]


def test_both_terms_of_a_slabs_change_are_on_one_level(monkeypatch):
    """Levels differ by more than a slab changes: where one term fell back alone, it was four per cent of a peak off."""
    tried = []

    def folds(scene, forces_n, levels):
        tried.append((scene.tissue.layers[0].youngs_modulus_kpa, levels))
        if levels == WITHOUT_INCLUSION[:1] and tried[-1][0] == 2.0:
            raise PressFailed("the contact folded")
        return np.full((2, len(forces_n), R), 10 * len(levels) + tried[-1][0])

    monkeypatch.setattr(module, "bare_per_n", folds)
    assert (slab_change_per_n(Slab(2.0, 46.0), Waveguide()) == 2.0 - 5.0).all()
    assert [levels for _, levels in tried] == [WITHOUT_INCLUSION[:1], *[WITHOUT_INCLUSION[1:2]] * 2]


def test_tissue_that_reaches_no_force_is_an_error(monkeypatch):
    def folds(*_):
        raise PressFailed("the contact folded")

    monkeypatch.setattr(module, "inclusions_per_n_mm3", folds)
    with pytest.raises(PressFailed, match="folded"):
        inclusion_in_slabs(scattered(1)[0], MISMATCHES, Waveguide())


AXES = InclusionAxes(points_with_ends(1.0, 15.0, 5), points_with_ends(4.0, 12.0, 4), MISMATCHES)
RADIAL = 1 + 0.3 * np.arange(R)


def nominal_table():
    """What an inclusion adds in the nominal slab: smooth in all, and of another profile at every size."""
    size, depth, mismatch, force, radius = np.meshgrid(*AXES, FORCES_N, RADIAL, indexing="ij")
    field = (2 - 0.05 * size * radius) * (1 - 0.03 * depth) * (1 + 0.2 * mismatch) * (1 + 0.5 * force)
    return NominalTable(AXES, np.stack([field, 3 * field]), FORCES_N)


def effect(size_mm, depth_mm, slab, force_n):
    """The share of the field itself that a slab adds: none in the nominal one, and a polynomial in the force."""
    stiffness, thinness = np.log(slab.youngs_modulus_kpa / 5.0), slab.thickness_mm**-2 - 30.0**-2
    return stiffness * (0.2 + 0.002 * size_mm * depth_mm) + 30 * thinness * (1 + force_n - force_n**2)


def solved_on_paper(one, shapes):
    """The rows of an inclusion whose slabs add `effect` of its field and a little of its growth with the depth."""
    fields = [
        shapes[0] * (1 + effect(one.size_mm, one.depth_mm, slab, SLAB_FORCES_N)[:, None])
        + 0.1 * np.log(slab.youngs_modulus_kpa / 5.0) * shapes[2]
        for slab in one.slabs
    ]
    fields = np.moveaxis(np.array(fields), 1, 2)
    for slab, field in zip(one.slabs, fields, strict=True):
        if slab.youngs_modulus_kpa < 2.1:
            field[:, :, 3:] = np.nan  # as far as it goes
    return as_rows(one, fields, shapes, MISMATCHES)


def test_what_changes_as_polynomials_is_fitted_and_carried_over_to_the_tables_forces():
    nominal = nominal_table()
    slabs = [Slab(kpa, mm) for kpa in MODULI_KPA for mm in THICKNESSES_MM]
    baseline = [np.full((2, len(SLAB_FORCES_N), R), np.log(slab.youngs_modulus_kpa / 5.0)) for slab in slabs]
    rows = [solved_on_paper(one, nominal.shapes(one)) for one in scattered(128)]
    changes = assembled(nominal, baseline, SlabRows(*map(np.concatenate, zip(*rows, strict=True))))
    slab, inclusion = Slab(2.05, 41.0), Inclusion(7.0, 5.5, 60.0)
    shapes = field_shapes(AXES, nominal.per_n_mm3, FORCES_N, inclusion, slab)
    expected = effect(7.0, 5.5, slab, FORCES_N)[:, None] * shapes[0] + 0.1 * np.log(2.05 / 5.0) * shapes[2]
    found = changes.inclusion_per_n(shapes, FORCES_N, inclusion, slab)
    assert np.abs(found - expected).max() < 2e-3 * np.abs(expected).max()
    np.testing.assert_allclose(changes.baseline_per_n(slab), np.log(2.05 / 5.0), rtol=1e-5)
