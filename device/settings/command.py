"""`python -m device config`: which settings there are."""

from __future__ import annotations

import argparse
from typing import Any

from device.settings.page import markdown

EXAMPLES = """example:
  python -m device config show --markdown          the page docs/settings.md
"""


def add_config_command(commands: Any) -> None:
    """Add `config show` to the daemon's commands."""
    config = commands.add_parser(
        "config", help="show the settings", epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    verbs = config.add_subparsers(dest="verb", metavar="show", required=True)
    show = verbs.add_parser("show", help="print every setting with unit, range, default and what it is")
    show.add_argument("--markdown", action="store_true", required=True, help="as the page docs/settings.md")


def run_config_command(options: argparse.Namespace) -> int:
    """Run `config show`; return the exit code."""
    print(markdown(), end="")
    return 0
