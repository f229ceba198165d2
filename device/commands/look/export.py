"""`python -m device export`: measurements to a file, as the exports over REST, also beside a daemon. It only reads.

Exit codes: 0 ok, 1 nothing was written.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path

from device.config import Config
from device.errors import StorageError
from device.exports.archive import archive_of
from device.exports.arrays import netcdf_of, npz_of
from device.exports.lesions import lesion_table
from device.exports.selection import Selection
from device.exports.table import long_table, wide_table
from device.files.durable import synced_file
from device.measurement.mode import MODES
from device.measurement.quantities import InvalidQuantity
from device.records.listing import Wanted
from device.records.store import Store

EXAMPLES = """examples:
  python -m device export                          a row a measurement, to the screen
  python -m device export --out all.csv --long     a row a quantity
  python -m device export --lesions                a row a lesion: mean, spread, repeatability
  python -m device export --out exam.zip --exam ID recordings with a table of them
  python -m device export --out all.npz            arrays for NumPy
  python -m device export --out all.nc             a netCDF data set with units
"""
SCREEN = Path("-")
KINDS = (".csv", ".npz", ".nc", ".zip")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    kinds = ", ".join(KINDS)
    parser.add_argument("--out", type=Path, default=SCREEN, metavar="FILE", help=f"a new file: {kinds}; else a table")
    parser.add_argument("--exam", metavar="ID", help="measurements of one exam")
    parser.add_argument("--mode", choices=MODES, help="measurements of one mode")
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--long", action="store_true", help="a table with a row for each quantity")
    form.add_argument(
        "--lesions", action="store_true", help="a table with a row for each lesion: how far presses agree"
    )
    parser.add_argument("--with-void", action="store_true", help="also what does not count")


def run(options: argparse.Namespace, config: Config) -> int:
    """Write the measurements; return the exit code, or raise what keeps them from being read or written."""
    out: Path = options.out
    if out != SCREEN and (out.suffix not in KINDS or out.exists()):
        raise InvalidQuantity("--out", out, f"a new file that ends with {' or '.join(KINDS)}", "choose another name")
    _require_fitting(options)
    with closing(Store(config.data, to_read=True)) as store:
        if options.exam:
            store.exams.exam(options.exam)  # one that is not there has no measurements, and nobody would be told
        wanted = Wanted(exam_id=options.exam, mode=options.mode)
        selection = Selection.of_now(store, wanted, with_void=options.with_void)
        pieces = _pieces(selection, store, out, options)
        if out == SCREEN:
            for piece in pieces:
                sys.stdout.buffer.write(piece)
            return 0
        _write(out, pieces)
    print(f"{out}: {out.stat().st_size / 1e6:.1f} MB. Patients' measurements are inside: keep it as you keep them.")
    return 0


def _require_fitting(options: argparse.Namespace) -> None:
    """Raise `InvalidQuantity` for options that do not go together: one of them would be passed over without a word."""
    out: Path = options.out
    for name in ("long", "lesions"):
        if getattr(options, name) and out != SCREEN and out.suffix != ".csv":
            raise InvalidQuantity(f"--out of --{name}", out, "a table, FILE.csv", f"name one, or leave out --{name}")
    if options.lesions and options.with_void:
        action = "leave out --with-void, or take the table without --lesions"
        raise InvalidQuantity("--with-void of --lesions", "given", "left out: what is void is in no lesion", action)


def _pieces(selection: Selection, store: Store, out: Path, options: argparse.Namespace) -> Iterable[bytes]:
    match out.suffix:
        case ".npz":
            return [npz_of(selection)]
        case ".nc":
            return [netcdf_of(selection)]
        case ".zip":
            return archive_of(store, selection)
    table = long_table if options.long else lesion_table if options.lesions else wide_table
    return table(selection)


def _write(out: Path, pieces: Iterable[bytes]) -> None:
    """Write a new file; nothing is left of one that could not be written whole."""
    try:
        with synced_file(out) as file:
            for piece in pieces:
                file.write(piece)
    except BaseException as error:
        out.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise StorageError(f"{out} could not be written: {error}.", "Choose another medium.") from error
        raise
