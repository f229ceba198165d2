"""Scenes at the edge of what can be asked: each ends in a result with its error or in a named refusal.

Every scene climbs as `host_tools simulate` does without a tolerance, in a process of its own under a time limit, so
that a hang or a crash is seen as what it is. A result counts only when its numbers are finite, its forces balance and
its stated error is not missing, or said not to be known.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import NamedTuple, cast

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.forward.error_estimates.stated_error import CANCELLING_UNDER_FORCE
from host_tools.forward.ladder import Climb, climb
from host_tools.forward.plan import DEFAULT_TOLERANCE
from host_tools.forward.press_model import PressFailed
from host_tools.scenes.scene import AskedStrain, Placement, Press, Scene, Tissue, TissueLayer, Waveguide

TIME_LIMIT_S = 300.0
BALANCE = 1e-5
"""Largest relative difference of the contact force and the reaction."""

CLIMBED_S = 30.0
"""Time to climb in: a scene at the edge ends with the best that was had."""

Build = Callable[[], Scene]


class Extreme(NamedTuple):
    """What became of one scene: `result`, `refused` before the solve, `gave up` by name, or a `failure`."""

    name: str
    outcome: str
    message: str
    force_n: float = math.nan
    max_deformation_mm: float = math.nan
    stated_error: float = math.nan

    @property
    def passed(self) -> bool:
        """Whether a user would know what happened."""
        return self.outcome != "failure"


def run_extremes(*, on_step: Callable[[Extreme], None] = lambda case: None) -> list[Extreme]:
    """Run every extreme scene; none is skipped when another hangs or crashes."""
    found = []
    for name, build, strain in extreme_scenes():
        case = _in_own_process(name, build, strain)
        on_step(case)
        found.append(case)
    return found


def _in_own_process(name: str, build: Build, strain: AskedStrain) -> Extreme:
    context = get_context("forkserver")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send_attempt, args=(sender, name, build, strain))
    process.start()
    sender.close()  # so that the end of the process is the end of the pipe
    try:
        if receiver.poll(TIME_LIMIT_S):
            return cast(Extreme, receiver.recv())
        return Extreme(name, "failure", f"no answer after {TIME_LIMIT_S:g} s")
    except EOFError:
        return Extreme(name, "failure", "the process died")
    finally:
        process.kill()
        process.join()


def _send_attempt(sender: Connection, name: str, build: Build, strain: AskedStrain) -> None:
    sender.send(attempt(name, build, strain))


def attempt(name: str, build: Build, strain: AskedStrain) -> Extreme:
    """Build and solve one scene; what is not a result or a named refusal is a failure."""
    try:
        scene = build()
        climbed = climb(scene, [scene.press], tolerance=DEFAULT_TOLERANCE, strain=strain, within_s=CLIMBED_S)
    except InvalidQuantity as refusal:
        return Extreme(name, "refused", str(refusal))
    except PressFailed as failed:
        return Extreme(name, "gave up", str(failed))
    except Exception as error:  # noqa: BLE001 - a study of what escapes: the traceback itself is the finding
        return Extreme(name, "failure", f"{type(error).__name__}: {error}")
    return _found(name, climbed)


def _found(name: str, climbed: Climb) -> Extreme:
    [solution] = climbed.solutions
    stated = {key: value for key, value in solution.stated_error.items() if key != CANCELLING_UNDER_FORCE}
    numbers = [solution.force_n, *asdict(solution.inclusion_field).values()]
    balance = abs(solution.pressed.contact_force_n / solution.force_n - 1)
    is_told = all(not math.isnan(error) and (error < math.inf or climbed.missed) for error in stated.values())
    sound = all(map(math.isfinite, numbers)) and balance < BALANCE and stated and is_told
    plan = solution.plan
    kind = f"{plan.strain} strain, {plan.formulation}, {plan.grading} {plan.order}, {solution.elements} elements"
    return Extreme(
        name,
        "result" if sound else "failure",
        f"{kind}{f'; {climbed.missed}' if climbed.missed else ''}"
        if sound
        else f"numbers {numbers}, errors {stated}, forces out of balance by {balance:.1e}",
        solution.force_n,
        solution.inclusion_field.max_deformation_mm,
        max(stated.values()),
    )


def _centred(size_mm: float, depth_mm: float, modulus_kpa: float = 80.0, indentation_mm: float = 1.0) -> Scene:
    return Scene(Inclusion(size_mm, depth_mm, modulus_kpa), Press(indentation_mm=indentation_mm))


def _forced(force_n: float, dome_mm: float = 0.0) -> Scene:
    return Scene(Inclusion(10.0, 6.0, 80.0), Press(force_n=force_n), Waveguide(dome_mm=dome_mm))


def _large(thickness_mm: float, half_width_mm: float) -> Scene:
    tissue = Tissue(thickness_mm=thickness_mm, half_width_mm=half_width_mm)
    return Scene(Inclusion(10.0, 6.0, 80.0), tissue=tissue)


def _all_poisson(ratio: float) -> Scene:
    return Scene(
        Inclusion(10.0, 6.0, 80.0),
        waveguide=Waveguide(poisson_ratio=ratio),
        tissue=Tissue(poisson_ratio=ratio),
        placement=Placement(poisson_ratio=ratio),
    )


def _under(layer: TissueLayer) -> Scene:
    return Scene(Inclusion(10.0, 6.0, 80.0), tissue=Tissue(layers=(layer,)))


def _slab(
    thickness_mm: float, size_mm: float, depth_mm: float, indentation_mm: float, half_width_mm: float = 60.0
) -> Scene:
    tissue = Tissue(thickness_mm=thickness_mm, half_width_mm=half_width_mm)
    return Scene(Inclusion(size_mm, depth_mm, 80.0), Press(indentation_mm=indentation_mm), tissue=tissue)


def _waveguide(*moduli_kpa: float) -> Scene:
    return Scene(Inclusion(10.0, 6.0, 80.0), waveguide=Waveguide(layer_moduli_kpa=moduli_kpa))


def _domed(dome_mm: float, indentation_mm: float) -> Scene:
    return Scene(Inclusion(10.0, 6.0, 80.0), Press(indentation_mm=indentation_mm), Waveguide(dome_mm=dome_mm))


def _placed(place: Placement, size_mm: float = 10.0) -> Scene:
    return Scene(Inclusion(size_mm, 6.0, 80.0), placement=place)


def extreme_scenes() -> Iterator[tuple[str, Build, AskedStrain]]:
    """Yield name, scene and strain of every extreme: strain is chosen as for anyone, or asked for."""
    chosen: list[tuple[str, Build]] = [
        *((f"size {d:g} mm", partial(_centred, d, 6.0)) for d in (0.0, 1e-3, 1e-2, 0.1, 1.0, 18.0, 23.0, 23.99)),
        ("tangent to the base", partial(_centred, 24.0, 6.0)),
        ("one micron above the base", partial(_centred, 24.0 - 1e-6, 6.0)),
        *((f"depth {h:g} mm", partial(_centred, 10.0, h)) for h in (0.0, 1e-4, 0.01, 0.05, 0.2, 1.0, 15.0, 19.9, 20.0)),
        *((f"E ratio {ratio:g}", partial(_centred, 10.0, 6.0, 5.0 * ratio)) for ratio in (1e-3, 0.1, 1.0, 1e3, 1e6)),
        *((f"Poisson ratio {nu:g}", partial(_all_poisson, nu)) for nu in (0.0, 0.3, 0.499, 0.4999, 0.49999, 0.5)),
        *((f"indentation {mm:g} mm", partial(_centred, 10.0, 6.0, 80.0, mm)) for mm in (1e-6, 6.0, 29.9, 30.0)),
        *((f"force {force_n:g} N", partial(_forced, force_n)) for force_n in (1e-6, 0.5, 3.0, 7.0, 100.0, 1e4)),
        *((f"E ratio 1 + {part:g}", partial(_centred, 10.0, 6.0, 5.0 * (1 + part))) for part in (1e-6, -1e-6)),
        ("skin 1000 times stiffer", partial(_under, TissueLayer("skin", 1.5, 5e3))),
        ("fat 1000 times softer", partial(_under, TissueLayer("fat", 3.0, 5e-3))),
        ("skin of 0.01 mm", partial(_under, TissueLayer("skin", 0.01, 50.0))),
        ("inclusion touches a layer", partial(_under, TissueLayer("fat", 6.0, 3.0))),
        ("inclusion reaches into the skin", partial(_under, TissueLayer("skin", 7.0, 20.0))),
        ("waveguide layers 1000 apart", partial(_waveguide, 2e4, 20.0, 20.0)),
        ("slab thinner than the probe", partial(_slab, 8.0, 3.0, 2.0, 1.0)),
        ("slab of 1 mm", partial(_slab, 1.0, 0.3, 0.3, 0.1)),
        ("slab of 1 mm, 999 mm wide", partial(_slab, 1.0, 0.3, 0.3, 0.1, 999.0)),
        *((f"slab of {T:g} mm, {b:g} mm wide", partial(_large, T, b)) for T, b in ((999.0, 999.0), (999.0, 60.0))),
        ("press through the slab", partial(_slab, 8.0, 3.0, 2.0, 9.0)),
        ("inclusion wider than the probe", partial(_centred, 23.0, 3.0)),
        ("inclusion a flat disc of 25 mm", partial(_placed, Placement(width_ratio_x=5.0, width_ratio_y=5.0), 5.0)),
        ("dome of 1 mm at 6 mm", partial(_domed, 1.0, 6.0)),
        ("dome of 1 mm just touching", partial(_domed, 1.0, 0.01)),
        ("dome of 1 mm, less than touching", partial(_domed, 1.0, 1e-5)),
        *((f"dome of 1 mm, {force_n:g} N", partial(_forced, force_n, 1.0)) for force_n in (1e-5, 0.5, 100.0)),
        ("inclusion 30 mm off the axis", partial(_placed, Placement(offset_x_mm=30.0))),
        ("inclusion beyond the slab", partial(_placed, Placement(offset_x_mm=58.0))),
    ]
    yield from ((name, build, "auto") for name, build in chosen)
    for mm in (0.01, 3.0, 6.0):
        yield f"finite strain, {mm:g} mm", partial(_centred, 10.0, 6.0, 80.0, mm), "finite"
    yield "finite strain, shallow inclusion, 3 mm", partial(_centred, 15.0, 2.0, 120.0, 3.0), "finite"
    for force_n in (1.0, 100.0):
        yield f"finite strain, {force_n:g} N", partial(_forced, force_n), "finite"
    yield "finite strain, E ratio 1e6", partial(_centred, 10.0, 6.0, 5e6, 2.0), "finite"
    yield "finite strain, void", partial(_centred, 10.0, 6.0, 5e-3, 2.0), "finite"
    yield "finite strain, Poisson ratio 0.4999", partial(_all_poisson, 0.4999), "finite"
