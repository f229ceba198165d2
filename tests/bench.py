"""`make bench`: times everything that somebody waits for, prints one table, and fails where a stated bound is missed.

python tests/bench.py [CHAPTER ...] [--runs N] [--json FILE] [--compare FILE] [--out PAGE]
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # more threads make small products slower on a busy machine

from bench_page import medians, write_speed
from bench_table import Figure, print_table, write_table

CHAPTERS = ("work", "keeping", "forward", "toolkit", "starts", "acquisition", "daemon", "web", "darkness", "screen")
"""Each is a module `bench_CHAPTER` with a function `figures`."""
ASKED_FOR = ("endurance",)
"""Takes an hour: not without being named."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; return 1 when a figure misses its bound."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "chapters",
        nargs="*",
        metavar="CHAPTER",
        help=f"of {', '.join(CHAPTERS)}; else all of them. {', '.join(ASKED_FOR)}: only when named",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the figures there")
    parser.add_argument("--compare", type=Path, metavar="FILE", help="also print the change since such a file")
    parser.add_argument(
        "--runs", type=int, default=1, choices=range(1, 10), metavar="N", help="run all so often, 1 to 9"
    )
    parser.add_argument("--out", type=Path, metavar="PAGE", help="also write the page of all runs, docs/speed.md")
    asked = parser.parse_args(arguments)
    if unknown := set(asked.chapters) - {*CHAPTERS, *ASKED_FOR}:
        parser.error(f"no chapter {', '.join(sorted(unknown))}: choose of {', '.join(CHAPTERS + ASKED_FOR)}")
    chapters = asked.chapters or CHAPTERS
    runs: dict[str, list[list[Figure]]] = defaultdict(list)
    seconds: dict[str, float] = defaultdict(float)
    for _ in range(asked.runs):
        for chapter in chapters:
            begun_s = time.perf_counter()
            runs[chapter].append(print_table(_figures(chapter), asked.compare))
            seconds[chapter] += time.perf_counter() - begun_s
        if asked.out:
            write_speed(asked.out, CHAPTERS + ASKED_FOR, runs, seconds)
    shown = [figure for of_chapter in runs.values() for figure in medians(of_chapter)]
    if asked.json:
        write_table(shown, asked.json)
    missed = [figure for figure in shown if not figure.holds]
    for figure in missed:
        print(f"missed: {figure.chapter}, {figure.name}: is the machine busy?", file=sys.stderr)
    return 1 if missed else 0


def _figures(chapter: str) -> Iterator[Figure]:
    figures: Iterator[Figure] = import_module(f"bench_{chapter}").figures()
    return figures


if __name__ == "__main__":
    sys.exit(main())
