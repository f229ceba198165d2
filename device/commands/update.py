"""`python -m device update ...`: the same as `python -m device.update ...`, which needs no package of the release.

Exit codes: those of device/update/__main__.py.
"""

from __future__ import annotations

import argparse

from device.update.__main__ import ABOUT, add_update_verbs


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the verb's own verbs; it takes the root of the whole command line."""
    parser.description = ABOUT
    add_update_verbs(parser)
