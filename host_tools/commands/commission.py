"""`host_tools commission`: ramps on phantoms to the modes of one's own probe, or all that speaks against it is told."""

from __future__ import annotations

import json
import shlex
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.quantities import InvalidQuantity, require
from host_tools.commands.output import Scheduler, gate_line, note, problem_record, require_writable_folder
from host_tools.commands.probe import probe_with_tables
from host_tools.workers import workers

if TYPE_CHECKING:
    from device.measurement.bundle import ModelBundle
    from device.measurement.calibration import Calibration
    from device.measurement.ramp_modes.commissioned.row_derivatives import RowDerivatives
    from device.measurement.ramp_modes.model import RampModel
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.commissioning.bench_files import StatedBench
    from host_tools.commissioning.commission import CommissionedProbe
    from host_tools.commissioning.own_quick import OwnQuick

NO_CERTIFICATE = "The recordings make no certificate, and the daemon takes no press without one."
STANDARD, QUICK = MODELS / "standard", MODELS / "quick"


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
    certificate: Annotated[
        bool, typer.Option(help="Ask for a certificate; without one the daemon takes no press.")
    ] = True,
    scheduler: Scheduler = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print gates, or problems, as one JSON object.")] = False,
) -> None:
    """Find out what a probe is from its ramps on phantoms, and make its modes standard, precise and quick.

    Standard and precise are the design's with what is the probe's own; quick is trained, for the folder OUT-quick.

    Each phantom is also answered as unknown, by a probe commissioned without it. Gates of misfit and coverage of these,
    and of how far the probe lies from its design, must be passed; otherwise nothing is written and the exit code is 1.
    The probe's certificate stands in the same folder. Recordings that make none are refused, unless `--no-certificate`
    is given; those older than `--valid-days` always are.
    All that is wrong in the files is told at once. Some eight minutes on two cores.
    """
    from host_tools.calibration.gates import CalibrationRejected

    order = CommissioningOrder(
        tuple(recordings), probe, phantoms, out, design, table, valid_days, seed, operator,
        quick_design if quick else None, certificate,
    )  # fmt: skip
    order.require_possible()
    shared = _design(order)
    try:
        with workers(scheduler):
            made = _commissioned(order, shared)
    except CalibrationRejected as rejection:
        if not as_json:
            raise
        print(json.dumps({"accepted": False, "problems": [problem_record(one) for one in rejection.problems]}))
        raise typer.Exit(1) from rejection
    _write(order, made)
    if as_json:
        print(json.dumps(_record(order, made)))
    else:
        _show(order, made)


@dataclass(frozen=True)
class CommissioningOrder:
    """What is to be commissioned, of which files, by whom, for how long; without `quick_design` no mode quick.

    Without `certificate` the bundles are made of recordings that make none, too.
    """

    recordings: tuple[Path, ...]
    probe: Path
    phantoms: Path
    out: Path
    design: Path
    table: Path
    valid_days: float
    seed: int
    operator: str
    quick_design: Path | None
    certificate: bool = True

    @property
    def quick_out(self) -> Path | None:
        """The folder of mode quick, None where none is to be."""
        from host_tools.commissioning.own_bundle import quick_folder

        return quick_folder(self.out) if self.quick_design else None

    @property
    def command(self) -> str:
        """The command that does the same again, for the card."""
        stated: Mapping[str, object] = {
            "--probe": self.probe,
            "--phantoms": self.phantoms,
            "--out": self.out,
            "--seed": self.seed,
            "--design": self.design,
            "--table": self.table,
            "--valid-days": f"{self.valid_days:g}",
            "--operator": self.operator,
            "--quick-design": self.quick_design,
        }
        options = [str(word) for pair in stated.items() if pair[1] not in ("", None) for word in pair]
        own = [*([] if self.quick_design else ["--no-quick"]), *([] if self.certificate else ["--no-certificate"])]
        return shlex.join(["host_tools", "commission", *map(str, self.recordings), *options, *own])

    def require_possible(self) -> None:
        """Raise `InvalidQuantity` for what would end minutes of work in nothing."""
        from host_tools.commissioning.own_bundle import VALID_DAYS, require_new

        for folder in filter(None, (self.out, self.quick_out)):
            require_new(folder)
            require_writable_folder(folder)
        require("valid_days", self.valid_days, VALID_DAYS, "commission again before that")
        probe_with_tables(None, self.table)


@dataclass(frozen=True, eq=False)
class _Commissioned:
    """What was found, when, from which bench and by which `design`, and until when it holds.

    A certificate where the recordings make one, else what they lack of it.
    """

    design: str
    bench: StatedBench
    found: CommissionedProbe
    own_quick: OwnQuick | None
    certificate: Calibration | None
    lacks: list[InvalidQuantity]
    made_at: datetime
    expires_at: str

    @property
    def advice(self) -> list[str]:
        """What would make the next commissioning better, in sentences."""
        from host_tools.commissioning.report import coverage_told, levels_at_their_end

        return [*levels_at_their_end(self.found.fit), *coverage_told(self.found.phantoms),
                *self.bench.phantoms.advice()]  # fmt: skip


class _Design(NamedTuple):
    """What the probe is believed to be built by: modes standard and precise, derivatives, and of quick the last two."""

    model: RampModel
    derivatives: RowDerivatives
    of_quick: tuple[ProbeTables, ModelBundle] | None


def _design(order: CommissioningOrder) -> _Design:
    """Read the design; raises `BundleRefused` or `InvalidQuantity` for one that does not hold."""
    from device.files.bundle_file import read_quick_model, read_ramp_model
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.press_models.press_derivatives import load_derivatives

    model, derivatives = read_ramp_model(order.design), load_derivatives(order.table)
    if order.quick_design is None:
        return _Design(model, derivatives, None)
    return _Design(model, derivatives, (ProbeTables.load(order.table), read_quick_model(order.quick_design).bundle))


def _commissioned(order: CommissioningOrder, design: _Design) -> _Commissioned:
    """Return the commissioned probe; raise `CalibrationRejected` where gates are missed."""
    from host_tools.commissioning.bench_files import read_bench
    from host_tools.commissioning.commission import commission as run_commission
    from host_tools.commissioning.own_quick import train_own_quick
    from host_tools.scenes.probe_file import simulated_probe

    made_at = datetime.now(UTC)
    model, derivatives, of_quick = design
    bench = read_bench(order.recordings, order.probe, order.phantoms, simulated_probe())
    expires_at = _expiry_of(bench, order, made_at)
    certificate, lacks = _certificate_of(bench, order, made_at)
    say = partial(note.print, soft_wrap=True, markup=False)
    found = run_commission(bench.ramps, model, derivatives, prior=bench.prior, seed=order.seed, say=say)
    own_quick = train_own_quick(found.answers, *of_quick, seed=order.seed, say=note.print) if of_quick else None
    found = replace(found, held=own_quick.believed if own_quick else None)
    return _Commissioned(model.bundle.name, bench, found, own_quick, certificate, lacks, made_at, expires_at)


def _expiry_of(bench: StatedBench, order: CommissioningOrder, made_at: datetime) -> str:
    """Return until when the bundles hold; raise `CalibrationRejected` for recordings that are too old for any."""
    from device.measurement.calibration import written
    from host_tools.calibration.gates import age_gate, require_all
    from host_tools.commissioning.own_certificate import validity_of

    validity = validity_of(bench.recordings, written(made_at), order.valid_days)
    require_all([age_gate(validity, written(made_at))])
    return validity.expires_at


def _certificate_of(
    bench: StatedBench, order: CommissioningOrder, made_at: datetime
) -> tuple[Calibration | None, list[InvalidQuantity]]:
    """Return the certificate, or None and everything that the recordings lack, which is told.

    Raises `CalibrationRejected` with that where the order asks for one.
    """
    from device.measurement.calibration import written
    from host_tools.calibration.gates import CalibrationRejected
    from host_tools.commissioning.own_certificate import own_certificate

    try:
        made = own_certificate(
            bench.recordings,
            bench.names,
            bench.probe,
            phantom_serial=bench.phantoms.serial,
            operator=order.operator,
            made_at=written(made_at),
            valid_days=order.valid_days,
            block_names=bench.block_names,
        )
    except InvalidQuantity as refusal:
        lacks = list(getattr(refusal, "problems", [refusal]))
        if order.certificate:
            note.print(f"{NO_CERTIFICATE} --no-certificate makes the bundles all the same.", soft_wrap=True)
            raise CalibrationRejected(lacks) from refusal
        for line in (NO_CERTIFICATE, *lacks):
            note.print(str(line), soft_wrap=True, markup=False)
        return None, lacks
    return made, []


def _write(order: CommissioningOrder, made: _Commissioned) -> None:
    """Write the bundles of all modes, or none: a refusal of the second leaves nothing that is in the way."""
    from device.files.durable import sync_directory
    from host_tools.commissioning.own_bundle import quick_folder, require_new

    place = order.out.resolve()
    place.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{place.name}.", dir=place.parent) as scratch:
        folder = Path(scratch) / place.name
        _write_bundles(order, made, folder)
        for one in filter(None, (order.out, order.quick_out)):
            require_new(one)  # asked before, too, but hours ago
        if made.own_quick:
            quick_folder(folder).rename(quick_folder(place))
        folder.rename(place)
    sync_directory(place.parent)


def _write_bundles(order: CommissioningOrder, made: _Commissioned, folder: Path) -> None:
    from host_tools.commissioning.own_bundle import write_own_bundle, write_own_quick

    origin = {"phantoms": made.bench.phantoms.serial, "design": made.design}
    write_own_bundle(
        made.found,
        order.design,
        folder,
        serial=made.bench.probe.serial,
        made_at=made.made_at,
        expires_at=made.expires_at,
        command=order.command,
        origin=origin | _hashes(made.bench, order.probe, order.phantoms),
        certificate=made.certificate,
        lacks=[str(lack) for lack in made.lacks],
        advice=made.advice,
        is_simulated=any(recording.simulated for recording in made.bench.recordings),
    )
    if made.own_quick:
        write_own_quick(made.own_quick, folder)


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


def _record(order: CommissioningOrder, made: _Commissioned) -> dict[str, Any]:
    from host_tools.commissioning.own_bundle import CERTIFICATE_FILE

    return {
        "accepted": True,
        "path": str(order.out),
        "quick": order.quick_out and str(order.quick_out),
        "certificate": str(order.out / CERTIFICATE_FILE) if made.certificate else None,
        "lacks": [problem_record(lack) for lack in made.lacks],
        "gates": [gate.as_record() for gate in made.found.gates],
    }


def _show(order: CommissioningOrder, made: _Commissioned) -> None:
    from host_tools.commissioning.joint_fit import PROBE
    from host_tools.commissioning.own_bundle import CERTIFICATE_FILE
    from host_tools.commissioning.page import PAGE_FILE
    from host_tools.commissioning.report import phantom_lines, probe_lines

    found, certificate, out = made.found, made.certificate, order.out
    for line in (*probe_lines(found.fit, PROBE), *phantom_lines(found.phantoms)):
        print(line)
    if certificate and certificate.flat_field_ratio is not None:
        print(f"two presses on a bare block differ smoothly by {certificate.flat_field_ratio:.2%} of the light")
    for gate in found.gates:
        print(gate_line(gate))
    print(f"bundle in {out}: set standard_model to it, and serial to the probe's own; its page is {PAGE_FILE}")
    if certificate:
        print(f"certificate in it until {certificate.validity.expires_at}: set calibration to {out / CERTIFICATE_FILE}")
    if order.quick_out:
        print(f"bundle of mode quick in {order.quick_out}: set quick_model to it")
    for line in made.advice:
        print(line)
    if made.lacks:
        print(NO_CERTIFICATE, *made.lacks, sep="\n")
