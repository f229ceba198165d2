"""A scene to what its model departs from the truth by, apart from its mesh: small strain, the slab's width, the dome.

What small strain leaves out grows in proportion to the press as long as it is small. So a light press is solved twice
on one blunt mesh of low order, where the errors of the mesh cancel, and the difference scaled up: half a second, and no
element folds. A strain read from the small-strain solution alone costs a tenth of that, but over random scenes the
departure is 0.07 to 6 times such a strain (`host_tools verify --effectivity` measures what is stated here).

That tissue ends at the slab's half width, and that a dome is a gap of the contact and no thicker layer, are
idealisations of the scene: they are told apart, and in no stated error.
"""

from __future__ import annotations

from dataclasses import fields, replace
from functools import lru_cache
from math import inf, pi, sqrt

from host_tools.forward.deformation import Deformation
from host_tools.forward.error_estimates.stated_error import CANCELLING_UNDER_FORCE, numbers
from host_tools.forward.materials import LOCKING_POISSON_RATIO
from host_tools.forward.plan import GRADED, Level, ModelPlan, StrainModel, model_plan
from host_tools.forward.press_model import PressFailed
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve
from host_tools.scenes.scene import Placement, Scene

LIGHT_LEVEL = Level("sliding_coarse", 2)
LIGHT_RATIOS = (0.1, 0.01)
"""Shares of a press at which both are solved; the second where the first gives way."""
LEAST_STRAIN = 1e-3
"""Indentation of a light press over the slab's thickness or the face's radius, at least: rounding hides less."""
DEPARTURE_FACTOR = 2.0
"""Stated over what the light press tells: deep presses depart by more than in proportion."""
LEAST_SHARE = 0.25
"""A feature whose own departure crosses zero by chance is given this much of the largest of all."""

CONVERGED_LEVEL = Level(GRADED, 5)
"""By which two idealisations of a scene are compared, in small strain: their meshes differ, and must not be seen."""
LARGEST_MM, WIDEST_MM = 100.0, 1e3
"""Of a face's radius and a layer's thickness, and of a slab's half width: what scenes may have."""
DOME_VOLUME_RATIO = 0.5
"""Mean height of a paraboloid over its height."""

UNKNOWN = dict.fromkeys(("force_n", "indentation_mm", *(one.name for one in fields(Deformation))), inf)


@lru_cache(maxsize=64)
def strain_departure(scene: Scene) -> dict[str, float]:
    """Return the relative departure to state of force or indentation and of each of O1-O3; infinite if unknown.

    Of a scene that finite strain does not serve, that of `nearest_finite_scene`. Raise `PressFailed` for a press that
    turns matter inside out in small strain already.
    """
    nearest = nearest_finite_scene(scene)
    try:
        whole = small_strain_press(nearest)
    except PressFailed:
        if nearest == scene:
            raise
        return UNKNOWN
    depth_mm = LEAST_STRAIN * min(nearest.tissue.thickness_mm, nearest.waveguide.radius_mm)
    for ratio in LIGHT_RATIOS:
        share = max(ratio, depth_mm / whole.indentation_mm)
        try:
            light = solve(nearest.with_press(nearest.press.scaled(share)), _plan(nearest, "finite"))
        except PressFailed:
            continue
        return _stated(whole, light, share)
    return UNKNOWN


def small_strain_press(scene: Scene) -> Solution:
    """Return a scene at `LIGHT_LEVEL` in small strain; raise `PressFailed` where matter is turned inside out."""
    return solve(scene, _plan(scene, "small"))


@lru_cache(maxsize=64)
def idealisation_departures(scene: Scene) -> dict[str, float]:
    """Return by how much force or indentation and O1-O3 depart, relative, the worst of them, by idealisation.

    `half_width_departure`: from a slab twice as wide. `dome_departure`, under a dome alone: from a first layer as much
    thicker as the dome is on average. Both of `nearest_finite_scene` under a light press, for they do not depend on
    the press. Raise `PressFailed` as `solve` does.
    """
    nearest = nearest_finite_scene(scene)
    nearest = nearest.with_press(nearest.press.scaled(LIGHT_RATIOS[0]))
    tissue, probe = nearest.tissue, nearest.waveguide
    wider = replace(nearest, tissue=replace(tissue, half_width_mm=min(2 * tissue.half_width_mm, WIDEST_MM)))
    found = {"half_width_departure": _worst_difference(nearest, wider)}
    if scene.waveguide.dome_mm:
        first_mm, *rest_mm = probe.layer_thicknesses_mm
        thicker_mm = min(first_mm + DOME_VOLUME_RATIO * scene.waveguide.dome_mm, LARGEST_MM)
        thicker = replace(nearest, waveguide=replace(probe, layer_thicknesses_mm=(thicker_mm, *rest_mm)))
        found["dome_departure"] = _worst_difference(nearest, thicker)
    return found


def _worst_difference(scene: Scene, other: Scene) -> float:
    pair = [solve(one, _plan(one, "small", CONVERGED_LEVEL)) for one in (scene, other)]
    mine, others = (numbers(one.rays, one.pressed, one.baseline) for one in pair)
    uncounted = CANCELLING_UNDER_FORCE if scene.press.force_n is not None else ""
    return max(abs(mine[name] / value - 1) for name, value in others.items() if value and name != uncounted)


def largest_departure(scene: Scene) -> float:
    """Return the largest departure that counts, relative; raise as `strain_departure` does."""
    uncounted = CANCELLING_UNDER_FORCE if scene.press.force_n is not None else ""
    return max(departure for name, departure in strain_departure(scene).items() if name != uncounted)


def nearest_finite_scene(scene: Scene) -> Scene:
    """Return the nearest scene that finite strain serves, itself if it does.

    Centred, under a flat, round face of equal area, in a slab without an edge, and of no Poisson ratio that locks.
    """
    probe, tissue, place = scene.waveguide, scene.tissue, scene.placement
    radius_mm = min(probe.radius_mm * (2 / sqrt(pi) if probe.face == "square" else 1.0), LARGEST_MM)
    width_ratio = place.width_ratio_x if place.is_round else sqrt(place.width_ratio_x * place.width_ratio_y)
    layers = tuple(replace(one, poisson_ratio=_unlocked(one.poisson_ratio)) for one in tissue.layers)
    return Scene(
        scene.inclusion,
        scene.press,
        replace(probe, radius_mm=radius_mm, face="round", dome_mm=0.0, poisson_ratio=_unlocked(probe.poisson_ratio)),
        replace(tissue, edge_mm=None, layers=layers, poisson_ratio=_unlocked(tissue.poisson_ratio)),
        Placement(0.0, 0.0, width_ratio, width_ratio, _unlocked(place.poisson_ratio)),
    )


def _unlocked(poisson_ratio: float) -> float:
    return min(poisson_ratio, LOCKING_POISSON_RATIO)


def _plan(scene: Scene, strain: StrainModel, level: Level = LIGHT_LEVEL) -> ModelPlan:
    plan = model_plan(scene, strain=strain)
    return replace(plan, grading=level.grading, order=level.order, mesh="remeshed")


def _stated(whole: Solution, light: Solution, share: float) -> dict[str, float]:
    """Return what to state of the whole press, solved in small strain, from a share of it in finite strain."""
    small = numbers(whole.rays, whole.pressed.scaled(share), whole.baseline.scaled(share))
    finite = numbers(light.rays, light.pressed, light.baseline)
    own = {name: abs(small[name] / true - 1) / share if true else 0.0 for name, true in finite.items()}
    prescribed, uncounted = "indentation_mm", ""
    if whole.scene.press.force_n is not None:
        prescribed, uncounted = "force_n", CANCELLING_UNDER_FORCE
    least = LEAST_SHARE * max(departure for name, departure in own.items() if name != uncounted)
    given = {name: DEPARTURE_FACTOR * max(departure, least if finite[name] else 0.0) for name, departure in own.items()}
    return given | {prescribed: 0.0}
