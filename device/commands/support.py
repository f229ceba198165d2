"""`python -m device support`: what a maintainer needs to know of this probe, in one file without patients' data.

`python -m device.commands.support FILE` is the same where `python -m device` does not start: it needs the standard
library alone, and says of every section that it cannot have why.
Exit codes: 0 ok, 1 the file could not be written, 2 usage.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from device.care.support import write_support
from device.care.support_sections import SupportContext

EXAMPLES = """examples:
  python -m device support probe.zip                      versions, settings, log, health: no measurement
  python -m device.commands.support /media/stick/a.zip    also where `python -m device` does not start
Look into it before you send it: it is a zip of readable files.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    _add_arguments(parser)


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="the support file, a zip")
    parser.add_argument("--json", action="store_true", help="print the sections as one JSON object")


def run(options: argparse.Namespace) -> int:
    """Write the support file and say which sections are in it; return the exit code."""
    context = SupportContext(options.root, options.config, options.simulate)
    try:
        told = write_support(options.file, context)
    except OSError as error:
        print(f"The support file {options.file} cannot be written: {error.strerror}.", file=sys.stderr)
        return 1
    if options.json:
        print(json.dumps({"file": str(options.file), "sections": told}))
        return 0
    for name, reason in told.items():
        print(f"{name:14} {reason}")
    print(f"{options.file}: no measurement, no recording, no name is inside. Look into it before you send it.")
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line; return its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m device.commands.support", description="Write a file for whoever helps, without patients' data.",
        epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    _add_arguments(parser)
    parser.add_argument("--config", type=Path, metavar="FILE", help="the daemon's settings (TOML)")
    parser.add_argument("--root", type=Path, default=Path("/"), metavar="DIR", help="folder that stands for /")
    parser.set_defaults(simulate=False)
    return run(parser.parse_args(arguments))


if __name__ == "__main__":
    sys.exit(main())
