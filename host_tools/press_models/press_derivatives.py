"""Random presses, each in worlds that differ by one thing, to how profile rows change with what no parameter says.

Differences of the virtual probe's own forward model, one step from none: rows are smooth to 1e-7, and steps are
small against a tolerance, but for the skin's, which ends where it is expected to be. Harmonics are taken along the
inclusion's true direction, for a tilt may turn the bright side of a weak inclusion round. Some twelve minutes on two
cores; once a design, not a probe.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.files.table_file import load_table, save_table
from device.measurement.arrays import Array
from device.measurement.parameters import HIGH, LAYER_TOPS_MM, LOW, PARAMETERS, RANGES, Range, normalise
from device.measurement.quantities import Bound, require
from device.measurement.ramp_modes.commissioned.row_derivatives import (
    COUNT,
    DERIVATIVE_ARRAYS,
    DIRECTIONS,
    RegionDerivatives,
    RowDerivatives,
    row_derivatives_of,
)
from device.measurement.ramp_modes.legendre import LegendreSum, LegendreTerms
from device.measurement.ramp_modes.noise import light_ratio
from device.measurement.ramp_modes.radial_profile import COLUMNS, RESPONSE
from device.measurement.ramp_modes.surrogate import (
    DEPTH,
    OFFSET,
    SIZE,
    far_field_strength,
    offsets_in_range,
    polynomial_coordinates,
)
from device.simulation.physics.layer_table import EVEN, LayerRatios
from device.simulation.physics.skin import ContactLaw
from device.simulation.physics.world import (
    AS_BELIEVED,
    OverLesion,
    PressTilts,
    Relaxation,
    TissueInDepth,
    TrueLight,
    World,
)
from device.simulation.virtual_probe import ProbeTables
from host_tools.press_models.press_samples import (
    BESIDE_TO_MM,
    INCLUSIONS_A_SKIN,
    Draw,
    PressedScene,
    draw_beside,
    draw_parameters,
)
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed
from host_tools.probe_tables.surface_table import solved_for
from host_tools.scenes.probe import Probe

PRESSES, SEED = 900, 5
"""Presses of each region for the derivatives that are kept, and their seed."""
IN_TISSUE = RANGES | {"tissue_modulus_kpa": Range(2.1, 29.0, by_ratio=True)}
"""Tables end where tissue may give way, or be stiffer over the lesion than beside it."""
BASELINE_DEGREE, INCLUSION_DEGREE = 2, 2
OF_BASELINE = ("tissue_modulus_kpa", "slab_thickness_mm", "contact_pressure_kpa", "albedo", "spread_mm")
STEEPER = {"size_mm": 3, "depth_mm": 3, "offset_mm": 3}
"""Degrees of an inclusion's terms of one parameter alone; others go to `INCLUSION_DEGREE`."""
RIDGE = 1e-4
"""Coefficients are held to 0 as if by so many presses of a hundred each: terms are many."""


def world_changed(name: str, by: float, direction_rad: float) -> World:
    """Return the world that is `by` further along a direction of `DIRECTIONS`, the inclusion in a direction [rad]."""
    x, y = by * math.cos(direction_rad), by * math.sin(direction_rad)
    worlds: dict[str, Callable[[], World]] = {
        "contact_exponent": lambda: World(contact=ContactLaw(exponent=1 + by)),
        "face_modulus_log_ratio": lambda: World(layers=LayerRatios(face_modulus_ratio=math.exp(by))),
        "middle_modulus_log_ratio": lambda: World(layers=LayerRatios(middle_modulus_ratio=math.exp(by))),
        "backing_modulus_log_ratio": lambda: World(layers=LayerRatios(backing_modulus_ratio=math.exp(by))),
        "cell_span_ratio": lambda: World(cell_span_ratio=1 + by),
        "face_motion_ratio": lambda: World(face_motion_ratio=by),
        "contact_pressure_log_ratio": lambda: World(lesion=OverLesion(contact_pressure_ratio=math.exp(by))),
        "albedo_log_ratio": lambda: World(lesion=OverLesion(albedo_ratio=math.exp(by))),
        "tissue_log_ratio": lambda: World(lesion=OverLesion(tissue_modulus_ratio=math.exp(by))),
        "relaxation_ratio": lambda: World(relaxation=Relaxation(lost_ratio=by)),
        "skin_modulus_log_ratio": lambda: World(layers=LayerRatios(skin_modulus_ratio=math.exp(by))),
        **_uneven(by),
        "tilt_beside_deg": lambda: World(tilt=PressTilts(beside_x_deg=x, beside_y_deg=y)),
        "tilt_lesion_deg": lambda: World(tilt=PressTilts(lesion_x_deg=x, lesion_y_deg=y)),
        "light_along_ratio": lambda: World(light=TrueLight(lesion_side_ratio=(1 + x, 1 + y, 1 - x, 1 - y))),
        "light_pair_ratio": lambda: World(light=TrueLight(lesion_side_ratio=(1 + by, 1 - by, 1 + by, 1 - by))),
    }
    return worlds[name]()


def _uneven(by: float) -> dict[str, Callable[[], World]]:
    """Return worlds in which one layer of the tissue is stiffer, alike beside the lesion or over it alone."""
    return {
        f"{place}_{top_mm:g}_mm_log_ratio": partial(_in_layers, number, by, is_alike=is_alike)
        for place, is_alike in (("tissue_from", True), ("lesion_tissue_from", False))
        for number, top_mm in enumerate(LAYER_TOPS_MM)
    }


def _in_layers(stiffer: int, by: float, *, is_alike: bool) -> World:
    ratios: Any = tuple(math.exp(by) if layer == stiffer else 1.0 for layer in range(len(LAYER_TOPS_MM)))
    return World(tissue=TissueInDepth(ratios, ratios if is_alike else EVEN))


NAME, SCHEMA = "press_derivatives", "tsis.press_derivatives/5"
ACTION = "run `host_tools table --part derivatives` to make it again"


def write_derivatives(derivatives: RowDerivatives, missed: Array, folder: Path, probe: Probe) -> None:
    """Write press_derivatives.npz and its description: with the hash, and what is missed of each direction."""
    said = {name: round(float(one), 3) for name, one in zip(DIRECTIONS, missed, strict=True)}
    origin = {"schema": SCHEMA, "command": "host_tools table --part derivatives", "missed_ratio": said}
    save_table(folder, NAME, derivatives.arrays(), origin | solved_for(probe))


def load_derivatives(folder: Path) -> RowDerivatives:
    """Read the derivatives of a folder; raise `InvalidQuantity` when they are missing or not what they say."""
    arrays, _ = load_table(folder, NAME, SCHEMA, DERIVATIVE_ARRAYS, ACTION)
    return row_derivatives_of(arrays)


def changes_of_presses(tables: ProbeTables, parameters: Array, direction_rad: Array) -> tuple[Array, Array]:
    """Return rows [n, P] of presses without noise, and by how much each direction changes them a unit [n, COUNT, P].

    The inclusion of `light_pair_ratio` lies along the rows of the image, all others in `direction_rad` [n].
    """
    believed = PressedScene(tables)
    rows = np.array([
        believed.press(one, angle).as_row(angle) for one, angle in zip(parameters, direction_rad, strict=True)
    ])  # fmt: skip
    changes = np.empty((len(rows), COUNT, COLUMNS))
    for number, (name, direction) in enumerate(DIRECTIONS.items()):
        angles = np.zeros(len(rows)) if name == "light_pair_ratio" else direction_rad
        is_vector = direction.owner != "probe" and name in ("tilt_beside_deg", "tilt_lesion_deg", "light_along_ratio")
        alike = PressedScene(tables, world=AS_BELIEVED if is_vector else world_changed(name, direction.step, 0.0))
        for i, (one, angle) in enumerate(zip(parameters, angles, strict=True)):
            scene = PressedScene(tables, world=world_changed(name, direction.step, angle)) if is_vector else alike
            before = rows[i] if angle == direction_rad[i] else believed.press(one, angle).as_row(angle)
            changes[i, number] = (scene.press(one, angle).as_row(angle) - before) / direction.step
    return rows, changes


def sampled_derivatives(
    tables: ProbeTables, count: int = PRESSES, *, seed: int = SEED, jobs: int = -1
) -> tuple[RowDerivatives, Array]:
    """Return the derivatives of random presses, `count` near the inclusion and as many beside it, and what they miss.

    What is missed [COUNT] is the root mean square, over columns and one in six of the presses, which are kept apart and
    lie near the inclusion, over that of the changes. Raises `InvalidQuantity` for too few presses.
    """
    near, missed = _region(
        tables,
        count,
        partial(draw_parameters, ranges=IN_TISSUE),
        (float(LOW[OFFSET]), float(HIGH[OFFSET])),
        seed,
        jobs,
    )
    beside, _ = _region(
        tables, count, partial(draw_beside, ranges=IN_TISSUE), (float(HIGH[OFFSET]), BESIDE_TO_MM), seed + 1, jobs
    )
    return RowDerivatives(near, beside), missed


def _region(
    tables: ProbeTables, count: int, draw: Draw, ends_mm: tuple[float, float], seed: int, jobs: int
) -> tuple[RegionDerivatives, Array]:
    rng = np.random.default_rng(derived_seed(seed, "derivatives"))
    parameters = draw(count, rng, inclusions_a_skin=INCLUSIONS_A_SKIN)
    direction_rad = rng.uniform(0, 2 * np.pi, count)
    groups = range(-(-count // INCLUSIONS_A_SKIN))

    def sampled(group: int) -> tuple[Array, Array]:
        part = slice(INCLUSIONS_A_SKIN * group, INCLUSIONS_A_SKIN * (group + 1))
        return changes_of_presses(tables, parameters[part], direction_rad[part])

    rows, changes = (np.concatenate(part) for part in zip(*in_parallel(sampled, len(groups), jobs), strict=True))
    learned, kept = slice(0, count - count // 6), slice(count - count // 6, None)
    tried = fit_region(parameters[learned], rows[learned], changes[learned], ends_mm)
    missed = tried.changes(normalise(parameters[kept]), rows[kept]) - changes[kept]
    ratio = np.sqrt((missed**2).mean(axis=(0, 2)) / (changes[kept] ** 2).mean(axis=(0, 2)))
    return fit_region(parameters, rows, changes, ends_mm), ratio


def fit_region(parameters: Array, rows: Array, changes: Array, ends_mm: tuple[float, float]) -> RegionDerivatives:
    """Return the derivatives of presses with parameters [n, 9], rows [n, P] and changes [n, COUNT, P]."""
    of_baseline, of_inclusion = _baseline_degrees(), _inclusion_degrees()
    require("presses", len(rows), Bound(len(of_baseline) + len(of_inclusion), np.inf, "presses"), "simulate more")
    at = offsets_in_range(polynomial_coordinates(normalise(parameters), parameters), *ends_mm)
    baseline = LegendreTerms(of_baseline).values(at)
    strength = far_field_strength(parameters[:, SIZE], parameters[:, DEPTH])[:, None]
    inclusion = strength * LegendreTerms(of_inclusion).values(at)
    over_light = changes / light_ratio(rows)[:, None]
    field = np.delete(over_light, np.arange(RESPONSE.start, RESPONSE.stop), axis=2)
    found = _ridge(np.hstack([baseline, inclusion]), field.reshape(len(rows), -1))
    response = _ridge(baseline, over_light[:, :, RESPONSE].reshape(len(rows), -1))
    terms = len(of_baseline)
    whole = np.insert(
        found[:terms].reshape(terms, COUNT, -1),
        np.full(RESPONSE.stop - RESPONSE.start, RESPONSE.start),
        response.reshape(terms, COUNT, -1),
        axis=2,
    )
    return RegionDerivatives(
        LegendreSum(of_baseline, whole.reshape(terms, -1)), LegendreSum(of_inclusion, found[terms:]), *ends_mm
    )


def _ridge(design: Array, values: Array) -> Array:
    """Return least squares coefficients [M, Q] of values [n, Q], held a little to 0 where terms are alike."""
    scale = np.sqrt(np.mean(design**2, axis=0))
    held = np.sqrt(RIDGE * len(design)) * np.eye(design.shape[1])
    padded = np.vstack([values, np.zeros((design.shape[1], values.shape[1]))])
    found, *_ = np.linalg.lstsq(np.vstack([design / scale, held]), padded, rcond=None)
    return np.asarray(found / scale[:, None])


def _baseline_degrees() -> NDArray[np.uint8]:
    return _degrees(dict.fromkeys(OF_BASELINE, BASELINE_DEGREE), BASELINE_DEGREE)


def _inclusion_degrees() -> NDArray[np.uint8]:
    highest = dict.fromkeys(PARAMETERS, INCLUSION_DEGREE)
    mixed = _degrees(highest, INCLUSION_DEGREE)
    alone = [[degree if one == name else 0 for one in PARAMETERS] for name, degree in STEEPER.items()]
    return np.vstack([mixed, np.array(alone, np.uint8)])


def _degrees(highest: dict[str, int], total: int) -> NDArray[np.uint8]:
    """Return the degrees [M, 9] of all terms up to `highest` of each parameter and `total` together."""
    each = [range(highest.get(name, 0) + 1) for name in PARAMETERS]
    return np.array([degrees for degrees in product(*each) if sum(degrees) <= total], np.uint8)
