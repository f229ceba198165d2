"""The command line of the toolkit: one verb a function. Exit codes: 0 ok, 1 failed, 2 usage."""

from __future__ import annotations

from host_tools import interrupts  # noqa: F401 - before all that takes time

# isort: split
import sys

import typer

from device.measurement.quantities import InvalidQuantity
from host_tools.commands.calibrate import calibrate
from host_tools.commands.commission import commission
from host_tools.commands.evaluate import evaluate
from host_tools.commands.limits import limits
from host_tools.commands.measured_chapters import pages
from host_tools.commands.model import import_press, phantom, table
from host_tools.commands.modes import modes
from host_tools.commands.optics import optics
from host_tools.commands.output import note
from host_tools.commands.paper import paper
from host_tools.commands.probe import probe
from host_tools.commands.release import deploy, provision, release
from host_tools.commands.simulate import simulate
from host_tools.commands.sweep import netcdf, sweep
from host_tools.commands.tradeoff import tradeoff
from host_tools.commands.train import train
from host_tools.commands.verify import verify
from host_tools.commands.worlds import robustness, worlds

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Finite-element solves, sweeps, training, calibration and scores of the tactile probe's model.",
)
app.command(epilog="Example: host_tools simulate --size-mm 10 --depth-mm 6 --modulus-kpa 80 --explain")(simulate)
app.command(epilog="Example: host_tools verify --short --out build/verification.md")(verify)
app.command(epilog="Example: host_tools sweep --scenes 134 --seed 1 --out build/sweep.nc")(sweep)
app.command(epilog="Example: host_tools netcdf tsis-measurements.npz --out measurements.nc")(netcdf)
app.command(epilog="Example: host_tools train --mode standard --out models/standard")(train)
app.command(epilog="Example: host_tools table --out models/simulated_probe")(table)
app.command(epilog="Example: host_tools phantom --out build/phantoms")(phantom)
app.command(
    "import",
    epilog="Example: host_tools import bench/A1 --probe probe.toml --exposure-us 4000 "
    "--started-at 2026-11-02T09:30:00+01:00 --out ramps/A1.zip",
)(import_press)
app.command(epilog="Example: host_tools worlds --count 20 --seed 1 --out scenarios/worlds")(worlds)
app.command(epilog="Example: host_tools robustness --probes 3 --presses 20")(robustness)
app.command(
    epilog="Example: host_tools commission ramps/* --probe probe.toml --phantoms phantoms.toml --out models/TSIS-0007"
)(commission)
app.command(epilog="Example: host_tools calibrate build/phantoms/* --out build/calibration.json")(calibrate)
app.command(epilog="Example: host_tools evaluate --scenes 40")(evaluate)
app.command(epilog="Example: host_tools modes --out docs/modes.md")(modes)
app.command(epilog="Example: host_tools tradeoff --out docs/tradeoff.md")(tradeoff)
app.command(epilog="Example: host_tools paper --out docs/paper_protocol.md")(paper)
app.command(epilog="Example: host_tools pages --check")(pages)
app.command(epilog="Example: host_tools limits scene.toml --protocol protocols/precise.toml")(limits)
app.command(epilog="Example: host_tools provision RELEASE --host raspberrypi.local --serial TSIS-0007")(provision)
app.command(epilog="Example: host_tools deploy RELEASE --host tsis-0007.local")(deploy)
app.add_typer(optics, name="optics")
app.add_typer(probe, name="probe")
app.add_typer(release, name="release")


def main() -> None:
    """Run the command line; what cannot be used is one sentence and exit code 1."""
    try:
        app()
    except SystemExit:
        raise
    except _refusals() as error:
        note.print(str(error), markup=False, soft_wrap=True)
        sys.exit(1)


def _refusals() -> tuple[type[Exception], ...]:
    """Return what is told in one sentence; asked for when something was raised, since its homes load NumPy."""
    from device.measurement.bundle import BundleRefused
    from host_tools.forward.press_model import PressFailed
    from host_tools.paper_network.export_refused import ExportRefused

    return InvalidQuantity, BundleRefused, PressFailed, ExportRefused, OSError


if __name__ == "__main__":
    main()
