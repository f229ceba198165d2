"""The command line of what cuts the power: how often, how often at most in the control, by which chance."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS.parent), str(TESTS / "torture")]
from cut_disk import can_cut  # noqa: E402


def cut_options(description: str | None) -> argparse.Namespace:
    """Return what was asked for; exit with 2 where the power cannot be cut."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cuts", type=int, default=100)
    parser.add_argument("--control", type=int, default=20, help="at most so many cuts without synchronising")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if not can_cut():
        print("The power cannot be cut here: root, loop devices and mkfs.ext4 are needed.", file=sys.stderr)
        raise SystemExit(2)
    return options
