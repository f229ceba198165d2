"""The whole pressed face: centred it is the table's, off the axis continuous, tilted it lifts and still carries."""

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.simulation.physics.pressed_face import PressedFace, ProbePlacement
from device.simulation.physics.slab import NOMINAL, Slab

INCLUSION = Inclusion(10.0, 5.0, 80.0)
X_MM = np.linspace(-12, 12, 97, dtype=np.float32)[None, :]
Y_MM = X_MM.T
CELL_MM2 = 0.25**2
ON_FACE = np.hypot(X_MM, Y_MM) <= 10.8


@pytest.fixture(scope="module")
def face(tables):
    return PressedFace(tables.centred.ramps(INCLUSION), tables.off_axis, INCLUSION, X_MM, Y_MM)


@pytest.fixture(scope="module")
def beside(face):
    return face.at(0.5, ProbePlacement(40.0, 0.0))


@pytest.mark.parametrize("truth", [(12.0, 6.0, 60.0), (15.0, 4.0, 120.0), (5.0, 5.0, 80.0)])
@pytest.mark.parametrize("force_n", [0.05, 0.5])
def test_beside_the_lesion_nothing_of_the_inclusion_is_left(tables, truth, force_n):
    inclusion_field, none = (
        PressedFace(tables.centred.ramps(one), tables.off_axis, one, X_MM, Y_MM).at(force_n, ProbePlacement(40.0, 0.0))
        for one in (Inclusion(*truth), Inclusion(0.0, 6.0, 80.0))
    )
    for found, expected in zip(inclusion_field, none, strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-7)


def test_centred_the_fields_are_the_tables(face, tables):
    w_mm, p_kpa = face.at(0.5, ProbePlacement())
    baseline, inclusion_field = (ramp.at(0.5) for ramp in tables.centred.ramps(INCLUSION)[1:3])
    r_mm = np.hypot(X_MM, Y_MM)
    expected = np.interp(r_mm, tables.centred.r_mm, baseline.w_mm + inclusion_field.w_mm)
    np.testing.assert_allclose(w_mm[ON_FACE], expected[ON_FACE], rtol=1e-5)
    inside = r_mm < 9
    expected = np.interp(r_mm, tables.centred.r_mm, baseline.p_kpa + inclusion_field.p_kpa)
    np.testing.assert_allclose(p_kpa[inside], expected[inside], rtol=0.01)  # scaled to carry the force, see below


def test_the_pressure_carries_the_force(face):
    """The sum over the cells of 0.25 mm misses the rim's curve: 2 %."""
    for place in (ProbePlacement(), ProbePlacement(4.0, 3.0), ProbePlacement(tilt_x_deg=2.0)):
        assert face.at(0.5, place)[1].sum() * CELL_MM2 * 1e-3 == pytest.approx(0.5, rel=0.02)


def test_without_force_nothing_is_deformed_or_pressed(face):
    w_mm, p_kpa = face.at(0.0, ProbePlacement())
    assert not w_mm.any()
    assert not p_kpa.any()


def test_beyond_the_rim_there_is_no_pressure_and_the_deformation_fades(face):
    w_mm, p_kpa = face.at(0.5, ProbePlacement())
    assert not p_kpa[np.hypot(X_MM, Y_MM) > 11.01].any()
    assert w_mm[48, 96] < 0.2 * w_mm[48, 92]  # at 12 and at 11 mm


def test_a_probe_moved_to_the_right_sees_the_inclusion_on_its_left(face, beside):
    inclusion_field = face.at(0.5, ProbePlacement(5.0, 0.0))[0] - beside[0]
    row, column = np.unravel_index(np.where(ON_FACE, inclusion_field, 0).argmax(), inclusion_field.shape)
    assert row == 48
    assert -7.0 < X_MM[0, column] < -2.5


def test_the_field_turns_with_the_direction_of_the_inclusion(face):
    along_x, along_y = (face.at(0.5, place)[0] for place in (ProbePlacement(6.0, 0.0), ProbePlacement(0.0, 6.0)))
    np.testing.assert_allclose(along_x.T, along_y, atol=2e-4)


@pytest.mark.parametrize("offset_mm", [2.0, 16.0])
def test_where_one_law_of_the_offset_ends_the_next_begins(face, beside, offset_mm):
    """2 mm: power law to table; 16 mm: table to fading."""
    before, after = (face.at(0.5, ProbePlacement(offset_mm + step, 0.0))[0][ON_FACE] for step in (-1e-3, 1e-3))
    inclusion_field = np.abs(face.at(0.5, ProbePlacement())[0] - beside[0]).max()
    assert np.abs(before - after).max() < 0.002 * inclusion_field


def test_a_small_offset_departs_from_the_centred_field_in_proportion(face):
    """The first cosine mode leads: twice the offset, twice the difference."""
    centred = face.at(0.5, ProbePlacement())[0]
    once, twice = (face.at(0.5, ProbePlacement(offset, 0.0))[0] - centred for offset in (0.1, 0.2))
    assert np.abs(twice - 2 * once)[ON_FACE].max() < 0.15 * np.abs(twice[ON_FACE]).max()


@pytest.mark.parametrize("slab", [NOMINAL, Slab(4.4, 27.6), Slab(12.0, 20.0)])
def test_off_the_axis_an_inclusion_grows_with_the_force_as_the_centred_one_in_its_slab(tables, slab):
    """What it adds 4 mm aside is that of small strain in the slab, times the centred one's growth (root mean square).

    Along the line through the inclusion, where all cosines count.
    """

    def added_mm(force_n):
        inclusion_field, none = (
            PressedFace(tables.centred.ramps(one, slab), tables.off_axis, one, X_MM, Y_MM, slab)
            for one in (INCLUSION, Inclusion(0.0, INCLUSION.depth_mm, INCLUSION.youngs_modulus_kpa))
        )
        aside = ProbePlacement(-4.0, 0.0)
        return inclusion_field.at(force_n, aside)[0] - none.at(force_n, aside)[0]

    ramp, r_mm = tables.centred.inclusion_field(INCLUSION, slab), tables.centred.r_mm
    square, small_square = (r_mm @ face.w_mm**2 for face in (ramp.at(0.5), ramp.at_small_strain(0.5)))
    growth, modes = np.sqrt(square / small_square), tables.off_axis.modes(INCLUSION, 4.0, slab)[0]
    towards, away = modes.sum(axis=0), (modes * (-1.0) ** np.arange(len(modes))[:, None]).sum(axis=0)
    line_mm = np.where(
        X_MM[0] < 0, np.interp(-X_MM[0], tables.off_axis.r_mm, away), np.interp(X_MM[0], tables.off_axis.r_mm, towards)
    )
    inside = np.abs(X_MM[0]) < 10.8
    found = added_mm(0.5)[48][inside]
    np.testing.assert_allclose(found, 0.5 * growth * line_mm[inside], atol=2e-4 * found.max())


def test_a_tilt_presses_the_side_it_leans_to_and_lifts_the_other(face):
    """Ten degrees open the contact on the far side; there is no tension."""
    p_kpa = face.at(0.2, ProbePlacement(40.0, 0.0, tilt_x_deg=10.0))[1]
    assert p_kpa.min() == 0.0
    assert (p_kpa[:, 60:] * ON_FACE[:, 60:]).sum() > 3 * (p_kpa[:, :37] * ON_FACE[:, :37]).sum()
    lifted = (p_kpa == 0) & (np.hypot(X_MM, Y_MM) < 10)
    assert lifted[:, :48].any()
    assert not lifted[:, 49:].any()


def test_stiffer_tissue_resists_a_tilt_more_but_for_what_the_waveguide_gives_way(tables):
    """A small tilt beside the lesion adds a pressure that grows with the tissue's modulus, and by less than it."""

    def added_kpa(slab):
        beside = PressedFace(tables.centred.ramps(INCLUSION, slab), tables.off_axis, INCLUSION, X_MM, Y_MM, slab)
        tilted, straight = (beside.at(0.5, ProbePlacement(40.0, 0.0, tilt_x_deg=degrees))[1] for degrees in (0.1, 0.0))
        return (tilted - straight)[np.hypot(X_MM, Y_MM) < 9]

    soft, usual, firm = (np.abs(added_kpa(slab)).mean() for slab in (Slab(2.0), NOMINAL, Slab(30.0)))
    assert 2.0 < usual / soft < 2.5
    assert 2.0 < firm / usual < 6.0
