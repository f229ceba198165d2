"""Derivatives of profile rows: by differences of the virtual probe, and polynomials that give them back."""

import math

import numpy as np
import pytest

from device.files.bundle_file import read_ramp_model
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.parameters import HIGH, LOW, NEAR_NOMINAL, NOMINAL, box_of, denormalise, normalise
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.ramp_modes.commissioned.own_probe import OwnProbe, Place
from device.measurement.ramp_modes.commissioned.row_derivatives import (
    COUNT,
    DIRECTIONS,
    NAMES,
    STD,
    RowDerivatives,
)
from device.measurement.ramp_modes.commissioned.squared_tilt import FURTHER_RATIO, LEFT_STD, of_leaning
from device.measurement.ramp_modes.noise import LOADS, ErrorLevels, light_ratio
from device.measurement.ramp_modes.radial_profile import (
    COLUMNS,
    CONTRAST,
    FIRST,
    RESPONSE,
    SECOND,
)
from device.measurement.ramp_modes.surrogate import OFFSET
from device.simulation.physics.slab import Slab
from device.simulation.physics.world import AS_BELIEVED, PressTilts, World
from host_tools.press_models.press_derivatives import (
    IN_TISSUE,
    changes_of_presses,
    fit_region,
    load_derivatives,
    world_changed,
    write_derivatives,
)
from host_tools.press_models.press_samples import PressedScene, draw_parameters, profile_rows
from host_tools.probe_tables.force_ramps import CHANGES, press_ramps, scene_in
from host_tools.scenes.probe_file import simulated_probe
from host_tools.scenes.scene import Waveguide
from host_tools.scores.foreign_presses import seen_columns

ENDS_MM = float(LOW[OFFSET]), float(HIGH[OFFSET])


@pytest.mark.parametrize("name", [name for name in NAMES if name != "face_motion_ratio"])
def test_no_step_along_a_direction_is_no_change_of_the_world(name):
    assert world_changed(name, 0.0, 0.3) == AS_BELIEVED
    assert world_changed(name, DIRECTIONS[name].step, 0.3) != AS_BELIEVED


def test_a_step_that_no_layer_can_take_refuses_no_other_direction():
    assert world_changed("tilt_lesion_deg", 2.0, 0.0).tilt.lesion_x_deg == 2.0
    with pytest.raises(InvalidQuantity, match=r"world\.tissue\.lesion_ratio from 8 mm"):
        world_changed("lesion_tissue_from_8_mm_log_ratio", 2.0, 0.0)


def test_the_kept_derivatives_are_those_of_the_virtual_probe(tables):
    """On presses that they were not learnt from: of the sizes that count, within a fifth of themselves."""
    rng = np.random.default_rng(77)
    parameters = draw_parameters(3, rng, inclusions_a_skin=3, ranges=IN_TISSUE)
    direction_rad = rng.uniform(0, 2 * np.pi, 3)
    rows, changes = changes_of_presses(tables, parameters, direction_rad)
    kept = load_derivatives(SIMULATED_PROBE).changes(normalise(parameters), rows)
    for name, columns in (
        ("contact_exponent", RESPONSE), ("tilt_lesion_deg", FIRST), ("face_motion_ratio", RESPONSE),
        ("tissue_from_0_mm_log_ratio", RESPONSE), ("lesion_tissue_from_0_mm_log_ratio", CONTRAST),
    ):  # fmt: skip
        one, found = changes[:, NAMES.index(name), columns], kept[:, NAMES.index(name), columns]
        assert np.sqrt(np.mean((found - one) ** 2)) < 0.2 * np.sqrt(np.mean(one**2)), name


@pytest.mark.long
@pytest.mark.parametrize("slab", [(3.0, 30.0), (20.0, 40.0)])
def test_in_peoples_tissue_what_the_layers_change_is_that_of_fresh_solves(tables, slab):
    """By finite elements: each layer a tenth stiffer, of the contrast of a hard inclusion 6 mm deep.

    The press without the inclusion on the same mesh: only differences count.
    """
    hard, layers = Inclusion(10.0, 6.0, 100.0), Waveguide().layer_moduli_kpa
    believed = np.array([*hard.as_tuple(), *NOMINAL.values()])[None]

    def pressed(moduli_kpa: tuple[float, ...]) -> np.ndarray:
        scene = scene_in(Slab(*slab), hard, waveguide=Waveguide(layer_moduli_kpa=moduli_kpa))
        return profile_rows(tables, believed, ramps=press_ramps(scene, 0.6, CHANGES, CHANGES))

    rows, truly = pressed(layers), np.array(believed)
    truly[0, 3:5] = slab
    kept = load_derivatives(SIMULATED_PROBE).changes(normalise(truly), rows)[0]
    for number, name in enumerate(("face", "middle", "backing")):
        stiffer = tuple(kpa * (1.1 if place == number else 1) for place, kpa in enumerate(layers))
        change = (pressed(stiffer) - rows)[0, CONTRAST] / math.log(1.1)
        missed = kept[NAMES.index(f"{name}_modulus_log_ratio"), CONTRAST] - change
        assert np.linalg.norm(missed) < 0.3 * np.linalg.norm(change), name


def test_the_face_drawn_where_it_moved_to_changes_the_contrast_by_hundredths_of_its_peak(tables):
    """docs/forward_model.md says so where it says why models are made without it."""
    parameters = draw_parameters(6, np.random.default_rng(24), ranges=NEAR_NOMINAL)
    rows, moved = (
        np.array([PressedScene(tables, world=world).press(one, 0.0).as_row(0.0) for one in parameters])[:, CONTRAST]
        for world in (AS_BELIEVED, World(face_motion_ratio=1.0))
    )
    shares = np.abs(moved - rows).max(axis=1) / np.abs(rows).max(axis=1)
    assert 0.01 < np.median(shares) < 0.04
    assert shares.max() < 0.1


def test_rows_and_changes_have_the_inclusion_where_the_forward_model_has_it(tables):
    """First harmonics point at the inclusion; those of a softer contact grow where the inclusion's own are."""
    at = np.array([0.3, -0.4, 0.8, *np.zeros(5), 0.8])
    at[3:5] = box_of(NEAR_NOMINAL).middle[3:5]
    parameters, direction_rad = denormalise(at[None]), np.array([0.7])
    surrogate = read_ramp_model(MODELS / "standard").answers.surrogate
    rows, changes = changes_of_presses(tables, parameters, direction_rad)
    (expected,) = surrogate.rows(normalise(parameters), direction_rad)
    assert rows[0, FIRST] == pytest.approx(expected[FIRST], abs=0.01 * np.abs(expected[FIRST]).max())
    kept = load_derivatives(SIMULATED_PROBE).changes(normalise(parameters), rows)
    for name in ("contact_exponent", "contact_pressure_log_ratio"):
        found, true = (one[0, NAMES.index(name), FIRST] for one in (kept, changes))
        assert np.linalg.norm(found - true) < 0.3 * np.linalg.norm(true), name


@pytest.mark.parametrize("tissue_kpa", [5.0, 25.0])
def test_what_a_leaning_reference_does_to_second_harmonics_is_twice_what_is_told_of_it(tables, tissue_kpa):
    """A hand's habit, along the inclusion. Half of it is told: that the lesion leant instead would show alike.

    In stiff tissue it is a hundredth of the light, ten times the noise: presses were refused for it.
    """
    parameters = np.array([10.0, 7.0, 100.0, tissue_kpa, 30.0, 2.0, 0.5, 1.0, 0.0])
    leaning = World(tilt=PressTilts(beside_x_deg=DIRECTIONS["tilt_beside_deg"].std))
    straight, leant = (
        seen_columns(PressedScene(tables, world=one).press(parameters, 0.0), 0.0) for one in (AS_BELIEVED, leaning)
    )
    own = OwnProbe(load_derivatives(SIMULATED_PROBE), np.zeros(COUNT), np.diag(STD**2), ErrorLevels())
    place, rows = Place(normalise(parameters[None]), np.zeros(1), np.zeros(1)), straight[None, :COLUMNS]
    unmoved, moved = (own.changes(place, rows, one[None]).shift[0, SECOND] for one in (straight, leant))
    change = (leant - straight)[SECOND]
    assert np.linalg.norm(change - 2 * (moved - unmoved)) < 0.2 * np.linalg.norm(change)


@pytest.mark.long
def test_higher_orders_of_tilts_do_as_much_as_is_believed_of_them(tables):
    """Of random tilts in people's tissue, where the larger one's first harmonic is 0.15 to 0.5: 0.25 of its cube."""
    parameters = draw_parameters(40, np.random.default_rng(3), ranges=IN_TISSUE)
    derivatives, sizes, missed = load_derivatives(SIMULATED_PROBE), [], []
    for number, one in enumerate(parameters):
        habits = np.random.default_rng([1, number]).standard_normal((2, 2))
        tilt = PressTilts(*map(float, DIRECTIONS["tilt_lesion_deg"].std * habits.ravel()))
        straight, leant = (
            seen_columns(PressedScene(tables, world=world).press(one, 0.0), 0.0)
            for world in (AS_BELIEVED, World(tilt=tilt))
        )
        row = straight[None, :COLUMNS]
        (changes,) = derivatives.changes(normalise(one[None]), row)
        first = DIRECTIONS["tilt_beside_deg"].std * changes[NAMES.index("tilt_beside_deg"), FIRST].reshape(LOADS, -1)
        squares = np.pad(first**2, ((0, 0), (1, 0)))[None]
        on_lesion, beside = habits
        told, factor = of_leaning(squares, (on_lesion - beside)[None])
        rest = factor[0, :, :2] @ ((on_lesion + beside) / 2) / LEFT_STD
        missed.append((leant - straight - told[0] + rest)[CONTRAST])
        sizes.append((np.sqrt(squares[0]) * np.linalg.norm(habits, axis=1).max()).ravel())
    size, error = np.concatenate(sizes), np.concatenate(missed)
    where = (size > 0.15) & (size < 0.5)
    ratio = np.sqrt(np.mean(error[where] ** 2) / np.mean(size[where] ** 6))
    assert where.sum() > 100
    assert 0.5 * FURTHER_RATIO < ratio < 1.5 * FURTHER_RATIO


def test_changes_that_are_polynomials_are_given_back():
    rng = np.random.default_rng(1)
    parameters = draw_parameters(150, rng, ranges=NEAR_NOMINAL)
    at = normalise(parameters)
    rows = 0.1 * rng.standard_normal((150, COLUMNS))
    slope = rng.standard_normal((COUNT, COLUMNS))
    changes = light_ratio(rows)[:, None] * (1 + 0.3 * at[:, 3])[:, None, None] * slope
    region = fit_region(parameters, rows, changes, ENDS_MM)
    found = region.changes(at, rows)
    assert np.sqrt(np.mean((found - changes) ** 2)) < 0.01 * np.sqrt(np.mean(changes**2))


def test_too_few_presses_are_refused():
    parameters = draw_parameters(10, np.random.default_rng(1))
    with pytest.raises(InvalidQuantity, match="presses"):
        fit_region(parameters, np.zeros((10, COLUMNS)), np.zeros((10, COUNT, COLUMNS)), ENDS_MM)


def test_a_file_gives_derivatives_back_and_a_damaged_one_is_refused(tmp_path):
    kept = load_derivatives(SIMULATED_PROBE)
    assert isinstance(kept, RowDerivatives)
    write_derivatives(kept, np.zeros(COUNT), tmp_path, simulated_probe())
    again = load_derivatives(tmp_path)
    at, rows = np.zeros((1, len(LOW))), np.zeros((1, COLUMNS))
    assert np.array_equal(again.changes(at, rows), kept.changes(at, rows))
    file = tmp_path / "press_derivatives.npz"
    file.write_bytes(file.read_bytes()[:-1] + b"x")
    with pytest.raises(InvalidQuantity, match="hash"):
        load_derivatives(tmp_path)
