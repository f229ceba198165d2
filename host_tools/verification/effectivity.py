"""Whether stated errors hold the true ones: random scenes at every level that a command can choose, kind by kind.

A kind is a sort of model with its scenes, its levels and its truth. A statement is the stated error of one feature of
one scene at one level. What a press prescribes is none, nor is the total at a prescribed force, which all but cancels.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed

from device.measurement.quantities import Inclusion
from host_tools.forward.error_estimates.stated_error import numbers
from host_tools.forward.ladder import DOMED_ORDERS, FINITE_RUNGS, FLAT_ORDERS, WIDEST_RIM, solved_at
from host_tools.forward.model_departures import strain_departure
from host_tools.forward.plan import BLUNT, GRADED, STANDARD, Level, StrainModel, model_plan
from host_tools.forward.press_model import PressFailed
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve
from host_tools.pages.benchmark import Chapter, Table, at_least, at_most
from host_tools.scenes.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW, Placement, Press, Scene, Tissue, Waveguide
from host_tools.verification.tolerances import STIFFNESS_N_PER_MM, random_scene
from host_tools.verification.truths import true_numbers

REQUIRED_SHARE = 0.97
REQUIRED_MEDIAN = 5.0
"""Median of stated over true error above which a level states more than is needed: that benchmark may fail."""
STRAINS: tuple[StrainModel, ...] = ("small", "finite")
SMALLEST_SIZE_MM = 1.0
"""Inclusions below it move the face by less than a thousandth of what it is pressed: nobody sees them."""
UNRESOLVED = 1e-5
"""A true error below it is not resolved, and counts as held."""
DEPARTED = "small strain against finite"
DEPARTED_SCENES, DEPARTED_LEVEL = 24, Level("sliding", 3)
"""What small strain is said to depart by is compared with what it does on one mesh of this level."""
LIGHTEST, HEAVIEST = 0.02, 0.5
"""Shares of a random press at which it is: where small strain may be what is chosen."""
SLIDING_LEVELS = (BLUNT, *WIDEST_RIM, *FINITE_RUNGS[2:4])
FINEST_SLIDING = FINITE_RUNGS[4], FINITE_RUNGS[3]
"""Truths of finite strain, the first that can be had: corrected by what the same mesh errs in small strain."""

FEATURES = {
    "indentation_mm": (
        "force_n",
        "max_deformation_mm",
        "total_deformation_mm3",
        "central_deformation_mm3",
        "deformation_area_mm2",
    ),
    "force_n": ("indentation_mm", "max_deformation_mm", "central_deformation_mm3", "deformation_area_mm2"),
}
"""What is scored under a prescribed indentation and under a prescribed force: there the total all but cancels."""

DrawScene = Callable[[np.random.Generator], Scene]


class ErrorStatement(NamedTuple):
    """What one level stated of one feature of one scene, and what was true; relative."""

    kind: str
    level: str
    feature: str
    stated: float
    true: float

    @property
    def ratio(self) -> float:
        """Stated over true error, of one that is resolved."""
        return self.stated / max(self.true, UNRESOLVED)

    @property
    def is_held(self) -> bool:
        """Whether the true error lies within."""
        return bool(self.true <= max(self.stated, UNRESOLVED))


class ModelKind(NamedTuple):
    """A sort of model: how its scenes are drawn and how many, its levels, and the level of its truth."""

    name: str
    draw: DrawScene
    scenes: int
    levels: tuple[Level, ...]
    truths: tuple[Level, ...]
    is_finite: bool = False


def _graded(*orders: int) -> tuple[Level, ...]:
    return tuple(Level(GRADED, order) for order in orders)


def _press(rng: np.random.Generator, indentation_mm: float = 1.0, tissue_kpa: float = 5.0) -> Press:
    """Return a press of about an indentation, half of them by the force that makes it in the default scene."""
    if rng.random() < 0.5:
        return Press(indentation_mm=indentation_mm)
    return Press(force_n=indentation_mm * STIFFNESS_N_PER_MM * tissue_kpa / 5)


def _inclusion(rng: np.random.Generator) -> Inclusion:
    low, high = (SMALLEST_SIZE_MM, *PAPER_BOX_LOW[1:]), PAPER_BOX_HIGH
    return Inclusion(*(float(value) for value in rng.uniform(low, high)))


def box_scene(rng: np.random.Generator) -> Scene:
    """Return a scene of the training box, at 1 mm or 0.5 N."""
    return Scene(_inclusion(rng), Press(indentation_mm=1.0) if rng.random() < 0.5 else Press(force_n=0.5))


def corner_scene(rng: np.random.Generator) -> Scene:
    """Return a scene of a random corner of the training box, its smallest inclusions of 2 mm."""
    corners = list(product((2.0, 15.0), (4.0, 12.0), (40.0, 120.0)))
    return Scene(Inclusion(*corners[rng.integers(len(corners))]), _press(rng, float(rng.choice([0.5, 1.0, 2.5]))))


def domed_scene(rng: np.random.Generator) -> Scene:
    """Return a scene of the training box under a dome of 0.1-0.55 mm, which touches everywhere."""
    return replace(box_scene(rng), waveguide=Waveguide(dome_mm=float(rng.uniform(0.1, 0.55))))


def lifted_scene(rng: np.random.Generator) -> Scene:
    """Return a scene of the training box under a dome of 0.2-1 mm, pressed by up to 1.7 times it: its rim is off, or
    nearly so."""
    dome_mm, share = rng.uniform((0.2, 0.05), (1.0, 1.7))
    press = Press(indentation_mm=float(share * dome_mm))
    return replace(box_scene(rng), waveguide=Waveguide(dome_mm=float(dome_mm)), press=press)


def locking_scene(rng: np.random.Generator) -> Scene:
    """Return a scene of the training box whose materials are all but incompressible."""
    nu = float(rng.choice([0.4995, 0.4999, 0.49999]))
    scene = box_scene(rng)
    return replace(
        scene,
        waveguide=Waveguide(poisson_ratio=nu),
        tissue=Tissue(poisson_ratio=nu),
        placement=Placement(poisson_ratio=nu),
    )


def finite_scene(rng: np.random.Generator, *, by_force: bool) -> Scene:
    """Return a scene beyond the training box at what 0.2-2.5 mm takes."""
    while True:
        size_mm, slab_mm, mm = rng.uniform(2, 20), rng.uniform(15, 60), rng.uniform(0.2, 2.5)
        depth_mm, modulus_kpa, tissue_kpa = np.exp(rng.uniform(np.log((1, 10, 2)), np.log((15, 500, 20))))
        if size_mm + depth_mm < 0.9 * slab_mm:
            break
    force_n = float(mm * STIFFNESS_N_PER_MM * tissue_kpa / 5)
    return Scene(
        Inclusion(float(size_mm), float(depth_mm), float(modulus_kpa)),
        Press(force_n=force_n) if by_force else Press(indentation_mm=float(mm)),
        tissue=Tissue(youngs_modulus_kpa=float(tissue_kpa), thickness_mm=float(slab_mm)),
    )


def by_indentation(rng: np.random.Generator) -> Scene:
    """Return a scene for finite strain under a prescribed indentation."""
    return finite_scene(rng, by_force=False)


def under_force(rng: np.random.Generator) -> Scene:
    """Return a scene for finite strain under a prescribed force."""
    return finite_scene(rng, by_force=True)


def solid_scene(rng: np.random.Generator) -> Scene:
    """Return a scene with its inclusion off the axis, in a half body."""
    inclusion = Inclusion(*(float(value) for value in rng.uniform((4.0, 4.0, 40.0), (12.0, 9.0, 120.0))))
    return Scene(inclusion, box_scene(rng).press, placement=Placement(offset_x_mm=float(rng.uniform(1.0, 9.0))))


def light_scene(rng: np.random.Generator) -> Scene:
    """Return a centred scene of the enlarged box, pressed lightly."""
    scene = random_scene(rng)
    return scene.with_press(scene.press.scaled(float(np.exp(rng.uniform(np.log(LIGHTEST), np.log(HEAVIEST))))))


LOW_LEVELS, HIGH_LEVELS = _graded(*FLAT_ORDERS[:4]), _graded(*FLAT_ORDERS[4:])
KINDS = (
    ModelKind("small strain, box", box_scene, 20, LOW_LEVELS, _graded(8)),
    ModelKind("small strain, corners of the box", corner_scene, 20, LOW_LEVELS, _graded(8)),
    ModelKind("small strain, far beyond the box", random_scene, 20, LOW_LEVELS, _graded(8)),
    ModelKind("small strain, highest orders", random_scene, 8, HIGH_LEVELS, _graded(11)),
    ModelKind("small strain, level of data sets", box_scene, 20, (STANDARD,), _graded(7)),
    ModelKind("dome that touches everywhere", domed_scene, 8, _graded(*DOMED_ORDERS), _graded(7)),
    ModelKind("dome that lifts off", lifted_scene, 8, _graded(*DOMED_ORDERS), _graded(8)),
    ModelKind("Poisson ratio above 0.499", locking_scene, 8, LOW_LEVELS, _graded(8)),
    ModelKind("Poisson ratio above 0.499, highest orders", locking_scene, 3, HIGH_LEVELS, _graded(11)),
    ModelKind("finite strain, by indentation", by_indentation, 4, SLIDING_LEVELS, FINEST_SLIDING, is_finite=True),
    ModelKind("finite strain, under a force", under_force, 4, SLIDING_LEVELS, FINEST_SLIDING, is_finite=True),
    ModelKind("3-D, off the axis", solid_scene, 4, (STANDARD, *_graded(3, 4, 5)), _graded(6)),
)
"""`standard 3` and `blunt 3` are the levels of data sets. The dearest kinds have the fewest scenes."""


def measure_effectivity(
    kinds: Sequence[ModelKind] = KINDS,
    *,
    seed: int = 2411,
    jobs: int = 1,
    departed_scenes: int = 0,
    on_step: Callable[[str], None] = lambda what: None,
) -> list[ErrorStatement]:
    """Return every statement of random scenes of all kinds; the scenes of a kind depend on no other kind.

    Of `departed_scenes` more, what small strain is said to depart by.
    """
    found: list[ErrorStatement] = []
    for kind in kinds:
        on_step(kind.name)
        rng = np.random.default_rng([seed, *kind.name.encode()])
        scenes = [kind.draw(rng) for _ in range(kind.scenes)]
        for statements in Parallel(n_jobs=jobs)(delayed(scored)(kind, scene) for scene in scenes):
            found += statements
    rng = np.random.default_rng([seed, *DEPARTED.encode()])
    for statements in Parallel(n_jobs=jobs)(delayed(departed)(light_scene(rng)) for _ in range(departed_scenes)):
        found += statements
    return found


def scored(kind: ModelKind, scene: Scene) -> list[ErrorStatement]:
    """Return what every level of a kind states of a scene; nothing of levels that give way, or where the truth does."""
    truth_level, truth = true_numbers(scene, kind.truths, "finite" if kind.is_finite else "small")
    found = []
    for level in kind.levels:
        if level == truth_level:
            break
        try:
            solution = _at_level(kind, scene, level)
        except PressFailed:
            continue
        values = numbers(solution.rays, solution.pressed, solution.baseline)
        name = f"{level.grading} {level.order}"
        for feature in _features(scene):
            if true := truth.get(feature):
                error = abs(values[feature] / true - 1)
                found.append(ErrorStatement(kind.name, name, feature, solution.stated_error[feature], error))
    return found


def departed(scene: Scene) -> list[ErrorStatement]:
    """Return what small strain is said to depart from finite strain by, and does; nothing where a mesh gives way."""
    pair = []
    try:
        stated = strain_departure(scene)
        for strain in STRAINS:
            plan = replace(model_plan(scene, strain=strain), mesh="remeshed")
            solution = solve(scene, replace(plan, grading=DEPARTED_LEVEL.grading, order=DEPARTED_LEVEL.order))
            pair.append(numbers(solution.rays, solution.pressed, solution.baseline))
    except PressFailed:
        return []
    small, finite = pair
    return [
        ErrorStatement(DEPARTED, "light press", name, stated[name], abs(small[name] / finite[name] - 1))
        for name in _features(scene)
        if finite[name]
    ]


def _features(scene: Scene) -> tuple[str, ...]:
    return FEATURES["force_n" if scene.press.indentation_mm is None else "indentation_mm"]


def _at_level(kind: ModelKind, scene: Scene, level: Level) -> Solution:
    strain: StrainModel = "finite" if kind.is_finite else "small"
    if level in (STANDARD, BLUNT):
        return solve(scene, model_plan(scene, strain=strain), estimate_error=True)
    return solved_at(scene, level, strain=strain)


def chapter_of(found: Sequence[ErrorStatement]) -> Chapter:
    """Return the chapter of measured statements: what held is judged level by level, what is overstated is named."""
    judged, rows, overstated = [], [], []
    for kind, level in dict.fromkeys((one.kind, one.level) for one in found):
        mine = [one for one in found if (one.kind, one.level) == (kind, level)]
        ratios = [one.ratio for one in mine if one.true > UNRESOLVED]
        held, case = float(np.mean([one.is_held for one in mine])), f"{kind}: {level}"
        judged.append(at_least(case, f"share of {len(mine)} statements held", held, REQUIRED_SHARE))
        of_ratios = ("", "")
        if ratios:  # else nothing of what was stated is resolved
            median = float(np.median(ratios))
            judged.append(at_most(case, "median of stated over true error", median, REQUIRED_MEDIAN))
            overstated += [f"{case}, {median:.1f}"] if median > REQUIRED_MEDIAN else []
            of_ratios = (f"{median:.1f}", f"{min(ratios):.2g}")
        rows.append((kind, level, str(len(mine)), f"{held:.3f}", *of_ratios, f"{max(one.true for one in mine):.1e}"))
    header = ("kind", "level", "statements", "held", "median of stated over true", "least", "worst true error")
    return Chapter(
        "Stated errors",
        "Random scenes at every level that a command can choose, their stated error against the true one.",
        "No reference: a finer level of the same model.",
        tuple(judged),
        (Table("By kind of model and level", header, tuple(rows)),),
        facts={"statements": len(found), "held": sum(one.is_held for one in found), "overstated": overstated},
    )
