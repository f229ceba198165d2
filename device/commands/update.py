"""`python -m device update ...`: the same as `python -m device.update ...`, which needs no package of the release.

Exit codes: those of device/update/__main__.py.
"""

from __future__ import annotations

from typing import Any

from device.update.__main__ import ABOUT, add_update_verbs


def add_update_command(commands: Any) -> None:
    """Add the verb with its own verbs; it takes the root of the whole command line."""
    add_update_verbs(commands.add_parser("update", help="install a signed release, go back", description=ABOUT))
