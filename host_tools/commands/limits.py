"""`host_tools limits`: how well an inclusion can be known by a protocol, or a map of that over the box."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from device.files.shipped import MODELS, PROTOCOLS
from device.measurement.quantities import UNKNOWNS, Inclusion, InvalidQuantity
from host_tools.commands.measured_chapters import shown
from host_tools.commands.output import Scheduler, note, progress, require_writable
from host_tools.commands.probe import ProbeOption, with_probe
from host_tools.workers import workers

if TYPE_CHECKING:
    from host_tools.cramer_rao.bounds import Limits
    from host_tools.scenes.scene import Scene

STANDARD = PROTOCOLS / "standard.toml"
LETTERS = ("ln d", "ln h", "ln E")


def limits(
    scene: Annotated[Path | None, typer.Argument(help="TOML file of the scene.")] = None,
    protocol: Annotated[Path, typer.Option(help="TOML file of the protocol.")] = STANDARD,
    size_mm: Annotated[float | None, typer.Option(help="Diameter of the inclusion, without a scene file.")] = None,
    depth_mm: Annotated[float | None, typer.Option(help="Surface to the top of the inclusion.")] = None,
    modulus_kpa: Annotated[float | None, typer.Option(help="Young's modulus of the inclusion.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print bounds and correlations as JSON.")] = False,
    whole_map: Annotated[bool, typer.Option("--map", help="Map the box instead of one scene (minutes).")] = False,
    out: Annotated[
        Path | None, typer.Option(help="With --map: Markdown file; results and figure go beside it.")
    ] = None,
    probe: ProbeOption = None,
    scheduler: Scheduler = None,
) -> None:
    """Print the Cramer-Rao bound: the least error of size, depth and modulus that any method can have.

    Of --probe the waveguide counts; light and camera are the simulated probe's.
    """
    given = (size_mm, depth_mm, modulus_kpa)
    if whole_map:
        if protocol != STANDARD:
            raise InvalidQuantity("protocol", protocol, "left out with --map", "leave it out: the map has all of them")
        if as_json:
            raise InvalidQuantity("json", "asked for", "left out with --map", "read results/PAGE.json beside the page")
        with workers(scheduler):
            _write_map(out, [scene, *given, probe])
        return
    if out is not None:
        raise InvalidQuantity("out", out, "given with --map", "add --map, or print with --json")
    if scheduler is not None:
        raise InvalidQuantity(
            "scheduler", scheduler, "left out without --map", "one scene is solved here: leave it out"
        )
    from host_tools.cramer_rao.bounds import limits as bounds
    from host_tools.cramer_rao.protocol import read_protocol

    asked = read_protocol(protocol)
    found = bounds(with_probe(_scene(scene, given), probe), asked)
    if as_json:
        print(json.dumps(_record(found)))
    else:
        _print(found)


def _scene(path: Path | None, given: tuple[float | None, float | None, float | None]) -> Scene:
    from host_tools.scenes.scene import Scene
    from host_tools.scenes.scene_file import read_scene

    known = [value for value in given if value is not None]
    if path is not None and not known:
        return read_scene(path)
    if path is not None or len(known) < len(given):
        raise InvalidQuantity(
            "scene",
            "given twice" if path else "not given whole",
            "a TOML file, or all of --size-mm, --depth-mm and --modulus-kpa",
            "give one of the two",
        )
    return Scene(Inclusion(*known))


def _record(found: Limits) -> dict[str, Any]:
    """Return bounds as JSON: standard deviations of the logarithms, in per cent; null where nothing is known."""
    quoted = found.quoted.alone
    return {
        "std_percent": _percents(found.std),
        "std_with_box_percent": _percents(found.std_with_box),
        "identifiable": dict(zip(UNKNOWNS, found.identifiable, strict=True)),
        "not_converged": list(found.not_converged),
        "correlation": [[_finite(x) for x in row] for row in quoted.correlation],
        "worst_direction": [_finite(x) for x in quoted.worst_direction],
        "worst_std_percent": _finite(100 * quoted.worst_std),
        "by_order": {
            str(order): {
                "std_percent": _percents(limit.alone.std),
                "std_with_box_percent": _percents(limit.with_box.std),
            }
            for order, limit in found.by_order.items()
        },
    }


def _percents(std: Any) -> dict[str, float | None]:
    return {name: _finite(100 * value) for name, value in zip(UNKNOWNS, std, strict=True)}


def _finite(value: float) -> float | None:
    return float(value) if abs(value) < float("inf") else None


def _print(found: Limits) -> None:
    print(f"{'':22}" + "".join(f"{name:>20}" for name in UNKNOWNS))
    rows = {"measurement alone": found.std, "with the box as prior": found.std_with_box}
    for order, limit in found.by_order.items():
        rows[f"  alone, order {order}"] = limit.alone.std
    for name, std in rows.items():
        print(f"{name:22}" + "".join(f"{100 * value:18.3g} %" for value in std))
    verdicts = ["yes" if known else "no" for known in found.identifiable]
    print(f"{'identifiable':22}" + "".join(f"{verdict:>20}" for verdict in verdicts))
    worst = found.quoted.alone
    toward = ", ".join(f"{x:+.2f} {letter}" for x, letter in zip(worst.worst_direction, LETTERS, strict=True))
    print(f"known worst: {toward}, to {100 * worst.worst_std:.3g} %")
    if found.not_converged:
        note.print(
            f"The elements' errors are part of the bound of {', '.join(found.not_converged)}: both orders differ by "
            "more than 20 %, read it to that factor only."
        )


def _write_map(out: Path | None, given: list[object]) -> None:
    if out is None or any(value is not None for value in given):
        raise InvalidQuantity("map", "asked for", "asked for with --out and no scene", "add --out docs/accuracy.md")
    require_writable(out, (".md",))
    from joblib import Parallel, delayed

    from device.files.bundle_file import read_ramp_model
    from host_tools.cramer_rao.accuracy_figure import draw_map
    from host_tools.cramer_rao.accuracy_map import MODULI_KPA, inclusions, mapped_scene
    from host_tools.cramer_rao.accuracy_page import FIGURE, accuracy_facts
    from host_tools.cramer_rao.press_bound import beside_over_axis
    from host_tools.pages.page import FIGURES, Results, write_page

    beside = beside_over_axis(read_ramp_model(MODELS / "standard").answers)
    chosen, mapped = inclusions(), []
    with progress("scenes") as bar:
        task = bar.add_task("", total=len(chosen))
        # A batch shares the solve of its baseline.
        solving = Parallel(n_jobs=-1, return_as="generator", batch_size=len(MODULI_KPA))
        for solved in solving(delayed(mapped_scene)(inclusion) for inclusion in chosen):
            mapped.append(solved)
            bar.advance(task)
    figures = out.parent / FIGURES
    figures.mkdir(exist_ok=True)
    draw_map(mapped, figures / FIGURE)
    command = f"host_tools limits --map --out {shown(out)}"
    write_page(out, Results("accuracy", command, facts=accuracy_facts(mapped, beside)))
    note.print(f"{out} written.")
