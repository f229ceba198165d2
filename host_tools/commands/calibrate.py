"""`host_tools calibrate`: phantom recordings to a certificate, written once, or all that speaks against it is told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from device.files.durable import write_once
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.quantities import Bound, InvalidQuantity, require
from host_tools.commands.output import gate_line, note, problem_record, require_writable_folder
from host_tools.commands.probe import ProbeOption, probe_with_tables

if TYPE_CHECKING:
    from host_tools.calibration.calibrate import Calibrated
    from host_tools.calibration.known_bench import OnBench

MODEL = MODELS / "paper"


def calibrate(
    recordings: Annotated[list[Path], typer.Argument(help="Phantom recordings with truth.")],
    out: Annotated[Path, typer.Option(help="Certificate to write, NAME.json; or its folder, for ID.json in it.")],
    operator: Annotated[str, typer.Option(help="Who calibrates.")] = "",
    phantom_serial: Annotated[
        str, typer.Option(help="Serial number of the set of phantoms; the recordings' by default.")
    ] = "",
    valid_days: Annotated[
        float | None,
        typer.Option(help="Days from the first recording, 1-36500; 365, or of a simulated probe all of them."),
    ] = None,
    model: Annotated[Path, typer.Option(help="Bundle the certificate is for.")] = MODEL,
    table: Annotated[Path, typer.Option(help="Folder of the surface table.")] = SIMULATED_PROBE,
    force_n: Annotated[float, typer.Option(help="Force the probe is pressed with.")] = 0.5,
    probe: ProbeOption = None,
    phantoms: Annotated[
        Path | None,
        typer.Option(help="File of the phantoms, phantoms.toml: their truths and tissue. Without it, tissue of 5 kPa."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print gates, or problems, as one JSON object.")] = False,
) -> None:
    """Fit the three regressions from image to deformation features and write the certificate, once.

    Gates of number, spread and age of the phantoms, R2, leave-one-out error, dark level and saturation must all be
    passed; otherwise nothing is written and the exit code is 1. An existing file is never replaced.
    """
    from device.files.bundle_file import read_paper_model
    from device.simulation.physics.surface_table import load_surface_table
    from host_tools.calibration.calibrate import Provenance
    from host_tools.calibration.calibrate import calibrate as run_calibration
    from host_tools.calibration.gates import CalibrationRejected

    _require_new(out)
    require_writable_folder(out.parent if out.suffix == ".json" else out)
    require("force_n", force_n, Bound(0.0, 5.0, "N", low_included=False), "give the force of the recordings' presses")
    surface = load_surface_table(table)
    made, bench = _on_bench(recordings, probe, phantoms, table)
    try:
        done = run_calibration(
            made,
            read_paper_model(model),
            surface,
            force_n=force_n,
            provenance=Provenance(operator, phantom_serial, valid_days=valid_days),
            bench=bench,
        )
    except CalibrationRejected as rejection:
        if not as_json:
            raise
        print(json.dumps({"accepted": False, "problems": [problem_record(one) for one in rejection.problems]}))
        raise typer.Exit(1) from rejection
    path = _issue(done, out)
    if as_json:
        print(json.dumps(_record(done, path)))
    else:
        _show(done, path)


def _on_bench(recordings: list[Path], probe: Path | None, phantoms: Path | None, table: Path) -> OnBench:
    """Return the recordings and what is known beside them; refuse a table that is of another probe than the file."""
    from device.files.recording_file import read_recording
    from host_tools.calibration.known_bench import name_of, on_bench
    from host_tools.scenes.phantom_set import read_phantoms

    made_by = probe_with_tables(probe, table)
    names = [name_of(path) for path in recordings]
    known = read_phantoms(phantoms) if phantoms else None
    read = [read_recording(path) for path in recordings]
    if not all(one.simulated for one in read):
        for given, assumed in (
            (probe, "the waveguide of SIM-0001 (--probe)"),
            (phantoms, "tissue of 5 kPa (--phantoms)"),
        ):
            if given is None:
                note.print(f"Not given, so the lines are those of {assumed}.")
    return on_bench(read, names, made_by, known)


def _issue(done: Calibrated, out: Path) -> Path:
    """Write the certificate under the name that is asked for, or its own, and return its path."""
    path = out if out.suffix == ".json" else out / f"{done.certificate.id}.json"
    _require_new(path)
    write_once(path, done.certificate.to_json().encode())
    return path


def _require_new(path: Path) -> None:
    if path.suffix == ".json" and path.exists():
        raise InvalidQuantity("certificate", path, "a new file", "a certificate is written once: give another name")


def _record(done: Calibrated, path: Path) -> dict[str, Any]:
    certificate = done.certificate
    return {
        "accepted": True,
        "id": certificate.id,
        "path": str(path),
        "expires_at": certificate.validity.expires_at,
        "gates": [gate.as_record() for gate in done.gates],
    }


def _show(done: Calibrated, path: Path) -> None:
    from device.measurement.paper_mode.estimate import PAPER_UNITS
    from device.measurement.paper_mode.features import FEATURE_NAMES

    certificate = done.certificate
    for image, line, name in zip(FEATURE_NAMES, certificate.paper_lines.regressions, PAPER_UNITS, strict=True):
        law = f"{name} = {line.slope:.4g} {image} {line.intercept:+.3g}"
        print(f"{law:76} R2 {line.r_squared:.5f}  leave-one-out {line.leave_one_out_std:.3g}")
    for gate in done.gates:
        print(gate_line(gate))
    if not certificate.untouched.is_resolved:
        note.print(
            "The untouched face is too dark to tell fading LEDs: only light added to it will be warned of.",
            soft_wrap=True,
        )
    print(f"certificate {certificate.id} in {path}, until {certificate.validity.expires_at}")
