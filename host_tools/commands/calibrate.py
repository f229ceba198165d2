"""`host_tools calibrate` and `commission`: phantom recordings to a certificate, or to modes of one's own probe.

Either is written once, or all that speaks against it is told.
"""

from __future__ import annotations

import json
import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from device.files.durable import write_once
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.quantities import Bound, InvalidQuantity, require
from host_tools.commands.output import Scheduler, note, problem_record, require_writable_folder
from host_tools.commands.probe import ProbeOption, probe_with_tables
from host_tools.workers import workers

if TYPE_CHECKING:
    from datetime import datetime

    from device.measurement.calibration import Calibration
    from host_tools.calibration.calibrate import Calibrated
    from host_tools.calibration.gates import Gate
    from host_tools.calibration.known_bench import OnBench
    from host_tools.commissioning.bench_files import StatedBench
    from host_tools.commissioning.commission import CommissionedProbe

MODEL, STANDARD, QUICK = MODELS / "paper", MODELS / "standard", MODELS / "quick"


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
        print(_gate_line(gate))
    if not certificate.untouched.is_resolved:
        note.print(
            "The untouched face is too dark to tell fading LEDs: only light added to it will be warned of.",
            soft_wrap=True,
        )
    print(f"certificate {certificate.id} in {path}, until {certificate.validity.expires_at}")


def _gate_line(gate: Gate) -> str:
    return f"{gate.quantity:48} {gate.value:<10.4g} {gate.bound}"


def commission(
    recordings: Annotated[list[Path], typer.Argument(help="Ramps on phantoms, each file named as its phantom is.")],
    probe: Annotated[Path, typer.Option(help="File of the probe, probe.toml.")],
    phantoms: Annotated[Path, typer.Option(help="File of the phantoms, phantoms.toml, with bare blocks.")],
    out: Annotated[Path, typer.Option(help="New folder of the bundle, models/NAME.")],
    design: Annotated[Path, typer.Option(help="Bundle of modes standard and precise of the design.")] = STANDARD,
    table: Annotated[Path, typer.Option(help="Folder of the design's tables and derivatives.")] = SIMULATED_PROBE,
    valid_days: Annotated[float, typer.Option(help="Days until the probe is to be commissioned again.")] = 365.0,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the presses that limits and the card are made of.")] = 1,
    operator: Annotated[str, typer.Option(help="Who commissions.")] = "",
    quick: Annotated[bool, typer.Option(help="Train mode quick of the probe, too: four of the eight minutes.")] = True,
    quick_design: Annotated[Path, typer.Option(help="Bundle of mode quick of the design.")] = QUICK,
    scheduler: Scheduler = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print gates, or problems, as one JSON object.")] = False,
) -> None:
    """Find out what a probe is from its ramps on phantoms, and make its modes standard, precise and quick.

    Standard and precise are the design's with what is the probe's own; quick is trained, for the folder OUT-quick.

    Each phantom is also answered as unknown, by a probe commissioned without it. Gates of misfit and coverage of these,
    and of how far the probe lies from its design, must be passed; otherwise nothing is written and the exit code is 1.
    The probe's certificate stands in the same folder, where the recordings show its untouched face.
    All that is wrong in the files is told at once. Some eight minutes on two cores.
    """
    from datetime import UTC, datetime

    from device.files.bundle_file import read_quick_model, read_ramp_model
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.calibration.gates import CalibrationRejected
    from host_tools.commissioning.bench_files import read_bench
    from host_tools.commissioning.commission import commission as run_commission
    from host_tools.commissioning.own_bundle import (
        VALID_DAYS,
        quick_folder,
        require_new,
        write_own_bundle,
        write_own_quick,
    )
    from host_tools.commissioning.own_quick import train_own_quick
    from host_tools.commissioning.report import coverage_told, levels_at_their_end
    from host_tools.press_models.press_derivatives import load_derivatives
    from host_tools.scenes.probe_file import simulated_probe

    quick_out = quick_folder(out) if quick else None
    for folder in (out, quick_out) if quick_out else (out,):
        require_new(folder)
        require_writable_folder(folder)
    require("valid_days", valid_days, VALID_DAYS, "commission again before that")
    probe_with_tables(None, table)
    model, derivatives = read_ramp_model(design), load_derivatives(table)
    of_quick = (ProbeTables.load(table), read_quick_model(quick_design).bundle) if quick else None
    made_at = datetime.now(UTC)
    options = ["--probe", probe, "--phantoms", phantoms, "--out", out, "--seed", seed, "--design", design]
    options += ["--table", table, "--valid-days", f"{valid_days:g}", *(["--operator", operator] if operator else [])]
    options += ["--quick-design", quick_design] if quick else ["--no-quick"]
    command = shlex.join(["host_tools", "commission", *map(str, recordings), *map(str, options)])
    try:
        with workers(scheduler):
            bench = read_bench(recordings, probe, phantoms, simulated_probe())
            certificate = _certificate_of(bench, operator, made_at, valid_days)
            done = run_commission(bench.ramps, model, derivatives, prior=bench.prior, seed=seed, say=note.print)
            own_quick = train_own_quick(done.answers, *of_quick, seed=seed, say=note.print) if of_quick else None
            done = replace(done, held=own_quick.believed if own_quick else None)
    except CalibrationRejected as rejection:
        if not as_json:
            raise
        print(json.dumps({"accepted": False, "problems": [problem_record(one) for one in rejection.problems]}))
        raise typer.Exit(1) from rejection
    advice = [*levels_at_their_end(done.fit), *coverage_told(done.phantoms), *bench.phantoms.advice()]
    write_own_bundle(
        done,
        design,
        out,
        serial=bench.probe.serial,
        made_at=made_at,
        valid_days=valid_days,
        command=command,
        origin={"phantoms": bench.phantoms.serial, "design": model.bundle.name, **_hashes(bench, probe, phantoms)},
        certificate=certificate,
        advice=advice,
        is_simulated=any(recording.simulated for recording in bench.recordings),
    )
    if own_quick:
        write_own_quick(own_quick, out)
    if as_json:
        print(json.dumps(_commissioned_record(done, out, quick_out, certificate)))
    else:
        _show_commissioned(done, out, quick_out, certificate)
        for line in advice:
            print(line)


def _hashes(bench: StatedBench, probe: Path, phantoms: Path) -> dict[str, Any]:
    """Return what a commissioning was made of, to repeat it: files by their bytes, recordings by their last frame."""
    from hashlib import sha256

    from host_tools.calibration.gates import identity_of

    recordings = [
        {"name": name, "id": one.id, "started_at": one.started_at, "last_frame_sha256": identity_of(one)}
        for name, one in zip(bench.names, bench.recordings, strict=True)
    ]
    files = {
        f"{name}_file_sha256": sha256(file.read_bytes()).hexdigest()
        for name, file in (("probe", probe), ("phantoms", phantoms))
    }
    return {**files, "recordings": recordings}


def _certificate_of(bench: StatedBench, operator: str, made_at: datetime, valid_days: float) -> Calibration | None:
    """Return the certificate; where recordings do not make one, tell everything that they lack."""
    from device.measurement.calibration import written
    from host_tools.commissioning.own_certificate import own_certificate

    try:
        return own_certificate(
            bench.recordings,
            bench.names,
            bench.probe,
            phantom_serial=bench.phantoms.serial,
            operator=operator,
            made_at=written(made_at),
            valid_days=valid_days,
            block_names=bench.block_names,
        )
    except InvalidQuantity as refusal:
        note.print("The bundle gets no certificate, and the daemon takes no press without one:")
        note.print(str(refusal), soft_wrap=True)
        return None


def _commissioned_record(
    done: CommissionedProbe, out: Path, quick_out: Path | None, certificate: Calibration | None
) -> dict[str, Any]:
    from host_tools.commissioning.own_bundle import CERTIFICATE_FILE

    return {
        "accepted": True,
        "path": str(out),
        "quick": str(quick_out) if quick_out else None,
        "certificate": str(out / CERTIFICATE_FILE) if certificate else None,
        "gates": [gate.as_record() for gate in done.gates],
    }


def _show_commissioned(
    done: CommissionedProbe, out: Path, quick_out: Path | None, certificate: Calibration | None
) -> None:
    from host_tools.commissioning.joint_fit import PROBE
    from host_tools.commissioning.own_bundle import CERTIFICATE_FILE
    from host_tools.commissioning.page import PAGE_FILE
    from host_tools.commissioning.report import phantom_lines, probe_lines

    for line in (*probe_lines(done.fit, PROBE), *phantom_lines(done.phantoms)):
        print(line)
    if certificate and certificate.flat_field_ratio is not None:
        print(f"two presses on a bare block differ smoothly by {certificate.flat_field_ratio:.2%} of the light")
    for gate in done.gates:
        print(_gate_line(gate))
    print(f"bundle in {out}: set standard_model to it, and serial to the probe's own; its page is {PAGE_FILE}")
    if certificate:
        print(f"certificate in it until {certificate.validity.expires_at}: set calibration to {out / CERTIFICATE_FILE}")
    if quick_out:
        print(f"bundle of mode quick in {quick_out}: set quick_model to it")
