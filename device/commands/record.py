"""`python -m device record`: lead the operator through one press on a phantom and write its recording, with truth.

No certificate is needed: `host_tools calibrate` makes the first one of such recordings. Nothing is estimated.
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
from device.instrument.press.capture import PressEnded
from device.instrument.press.phantom_press import PhantomPress, PhantomTruth
from device.instrument.press.states import Guidance
from device.measurement.mode import MODES
from device.measurement.quantities import Inclusion, InvalidQuantity

EXAMPLES = """examples:
  python -m device record --size-mm 10 --depth-mm 6 --modulus-kpa 80 --out phantoms/1
  python -m device record --simulate --size-mm 8 --depth-mm 5 --modulus-kpa 60 --out phantoms/2
A daemon that runs holds the hardware: stop it first. Ctrl-C cancels the press.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    parser.add_argument("--size-mm", type=float, required=True, metavar="D", help="diameter of its inclusion")
    parser.add_argument("--depth-mm", type=float, required=True, metavar="H", help="surface to the inclusion's top")
    parser.add_argument("--modulus-kpa", type=float, required=True, metavar="E", help="the inclusion's Young's modulus")
    parser.add_argument("--mode", choices=MODES, default="paper", help="what is taken; paper, as calibrating needs")
    parser.add_argument("--phantom-serial", default="", metavar="S", help="serial number of the set of phantoms")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="the recording, a new folder")
    # Also before the command: there they are for every command.
    parser.add_argument("--simulate", action="store_true", default=argparse.SUPPRESS, help="on the virtual probe")
    parser.add_argument(
        "--scene", type=Path, default=argparse.SUPPRESS, metavar="FILE", help="its scene (TOML), all but the inclusion"
    )


def run_record_command(options: argparse.Namespace, opener: Callable[[Inclusion], PhantomPress]) -> int:
    """Record one press of the probe that `opener` opens, a virtual one on that inclusion; return the exit code.

    Raises `InvalidQuantity` for an inclusion that cannot be, and for a folder that is there already.
    """
    inclusion = Inclusion(options.size_mm, options.depth_mm, options.modulus_kpa)
    try:
        _require_new(options.out)
        with _ctrl_c() as cancelled:
            _tell(Guidance.KEEP_FREE)
            with closing(opener(inclusion)) as press:
                press.board.on_guidance(_tell)
                press.record(PhantomTruth(inclusion, options.phantom_serial), options.mode, options.out, cancelled)
    except DeviceError as error:
        print(f"{error.code} {error}", file=sys.stderr)
        return 1
    except (PressEnded, StartFailed) as end:
        print(end, file=sys.stderr)
        return 1
    print(options.out)
    return 0


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
def _ctrl_c() -> Iterator[threading.Event]:
    """Let Ctrl-C, or SIGTERM, set the event instead of stopping at any point: the press ends by itself, and dark."""
    asked = threading.Event()
    numbers = signal.SIGINT, signal.SIGTERM
    before = [signal.signal(number, lambda *_: asked.set()) for number in numbers]
    try:
        yield asked
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def _tell(guidance: Guidance) -> None:
    print(guidance.text, file=sys.stderr, flush=True)
