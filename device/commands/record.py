"""`python -m device record`: lead the operator through one press on a phantom and write its recording, with truth.

Or on a bare block of tissue, or on the two plates of a grid target: the blank one in place of the press beside.

No certificate is needed: `host_tools calibrate` and `commission` make the first one of such recordings. Nothing is
estimated. Commissioning knows a recording by its phantom's name, so one of a file is named as it stands there.
Exit codes: 0 ok, 1 the press failed or was cancelled.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from device.assembly.opened_parts import StartFailed
from device.errors import DeviceError, StorageError
from device.files.phantoms_file import read_phantom
from device.instrument.press.capture import PressEnded
from device.instrument.press.phantom_press import PhantomPress, PhantomTruth
from device.instrument.press.states import Guidance
from device.measurement.mode import MODES, Mode
from device.measurement.quantities import Inclusion, InvalidQuantity

RAMPS = Path("ramps")
"""Where recordings of a file's phantoms are, unless another place is named."""
EXAMPLES = """examples:
  python -m device record --phantoms phantoms.toml --name A1      for `host_tools commission`, to ramps/A1
  python -m device record --size-mm 10 --depth-mm 6 --modulus-kpa 80 --out phantoms/1
  python -m device record --simulate --size-mm 8 --depth-mm 5 --modulus-kpa 60 --out phantoms/2
  python -m device record --grid --out grid/1      the blank plate "beside the lesion", the printed one "on it"
A daemon that runs holds the hardware: stop it first. Ctrl-C cancels the press.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    parser.set_defaults(refuse=parser.error)
    parser.add_argument("--phantoms", type=Path, metavar="FILE", help="file of the phantoms, phantoms.toml")
    parser.add_argument("--name", metavar="NAME", help="which of its phantoms is pressed; the recording has its name")
    parser.add_argument("--size-mm", type=float, metavar="D", help="diameter of its inclusion")
    parser.add_argument("--depth-mm", type=float, metavar="H", help="surface to the inclusion's top")
    parser.add_argument("--modulus-kpa", type=float, metavar="E", help="the inclusion's Young's modulus")
    without = parser.add_mutually_exclusive_group()
    without.add_argument(
        "--bare", dest="inclusion_free", action="store_true", help="a block of tissue without an inclusion"
    )
    without.add_argument("--grid", action="store_true", help="a grid target in oil, for `host_tools probe camera`")
    parser.add_argument(
        "--mode",
        choices=MODES,
        help="what is taken; of a file's phantom standard, as commissioning needs, else paper, as calibrating does",
    )
    parser.add_argument("--phantom-serial", default="", metavar="S", help="serial number of the set of phantoms")
    parser.add_argument(
        "--out", type=Path, metavar="FOLDER", help="the recording, a new folder; ramps/NAME with --name unless given"
    )
    # Also before the command: there they are for every command.
    parser.add_argument("--simulate", action="store_true", default=argparse.SUPPRESS, help="on the virtual probe")
    parser.add_argument(
        "--scene", type=Path, default=argparse.SUPPRESS, metavar="FILE", help="its scene (TOML), all but the inclusion"
    )


def run_record_command(options: argparse.Namespace, opener: Callable[[PhantomTruth], PhantomPress]) -> int:
    """Record one press of the probe that `opener` opens, a virtual one on that phantom; return the exit code.

    Raises `InvalidQuantity` for an inclusion that cannot be, for a name that is not in the file of the phantoms, and
    for a folder that is there already.
    """
    phantom, out = _phantom(options), _out(options)
    mode: Mode = options.mode or ("standard" if options.name else "paper")
    try:
        _require_new(out)
        with ctrl_c() as cancelled:
            _tell(Guidance.KEEP_FREE)
            with closing(opener(phantom)) as press:
                press.board.on_guidance(_tell)
                press.record(phantom, mode, out, cancelled)
    except DeviceError as error:
        print(f"{error.code} {error}", file=sys.stderr)
        return 1
    except (PressEnded, StartFailed) as end:
        print(end, file=sys.stderr)
        return 1
    print(out)
    return 0


def _phantom(options: argparse.Namespace) -> PhantomTruth:
    """Return what is pressed: a phantom of a file, all three unknowns of an inclusion, or none of them.

    Anything else is wrong usage.
    """
    unknowns = options.size_mm, options.depth_mm, options.modulus_kpa
    is_whole, is_without = None not in unknowns, set(unknowns) == {None}
    if options.phantoms or options.name:
        if not is_without or options.inclusion_free or options.grid or options.phantom_serial:
            options.refuse("with --phantoms and --name the file says what is pressed: give nothing else of it")
        if not (options.phantoms and options.name):
            options.refuse("give --phantoms and --name together")
        return _phantom_of_file(options.phantoms, options.name)
    if options.inclusion_free or options.grid:
        if not is_without:
            options.refuse("with --bare or --grid there is no --size-mm, --depth-mm or --modulus-kpa")
        return PhantomTruth(None, options.phantom_serial, is_grid=options.grid)
    if not is_whole:
        options.refuse("give --size-mm, --depth-mm and --modulus-kpa, or --bare, or --grid, or --phantoms and --name")
    return PhantomTruth(Inclusion(*unknowns), options.phantom_serial)


def _phantom_of_file(file: Path, name: str) -> PhantomTruth:
    """Return the phantom of a name, and tell the operator which one to take."""
    known = read_phantom(file, name)
    inclusion = known.inclusion
    described = "{:g} mm, {:g} mm deep, {:g} kPa".format(*inclusion.as_tuple()) if inclusion else "a bare block"
    print(f"Phantom {name} of {known.set_serial}: {described}", file=sys.stderr, flush=True)
    tissue = known.tissue_modulus_kpa, known.tissue_thickness_mm
    return PhantomTruth(inclusion, known.set_serial, tissue_kpa_mm=tissue)


def _out(options: argparse.Namespace) -> Path:
    """Return the recording's folder; one of a file's phantom ends with its name."""
    out: Path | None = options.out
    if options.name is None:
        if out is None:
            options.refuse("the following arguments are required: --out")
        return Path(options.out)
    if out is not None and out.name != options.name:
        action = "commissioning knows a recording by its phantom's name: let the folder have it"
        raise InvalidQuantity("out", out, f"a folder named {options.name}", action)
    return out or RAMPS / str(options.name)


def _require_new(folder: Path) -> None:
    """Refuse, before anything is opened, a folder that is there or cannot be made."""
    if os.path.lexists(folder):
        raise InvalidQuantity("out", folder, "a new folder", "a recording is never replaced: give another name")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"{folder.parent} cannot be made: {error}.", "Give another folder.") from error
    if not os.access(folder.parent, os.W_OK | os.X_OK):
        raise StorageError(f"{folder.parent} cannot be written.", "Give another folder, or change its permissions.")


@contextmanager
def ctrl_c() -> Iterator[threading.Event]:
    """Let Ctrl-C, SIGTERM or a terminal that is gone set the event instead of stopping at any point: it ends dark."""
    asked = threading.Event()
    numbers = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
    before = [signal.signal(number, lambda *_: asked.set()) for number in numbers]
    try:
        yield asked
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def _tell(guidance: Guidance) -> None:
    print(guidance.text, file=sys.stderr, flush=True)
