"""Prints by how much the numbers of two JSON files differ; exit code 1 above a bound: compare_answers.py A B BOUND.

A difference is relative to the larger of the number itself and `FLOOR`: log odds cross zero. That of a quantity with an
interval is in units of its spread, `std`: what decides whether an answer is another one.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

FLOOR = 1.0


def numbers(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every leaf with its place."""
    if isinstance(value, dict | list):
        entries = value.items() if isinstance(value, dict) else enumerate(value)
        for name, part in entries:
            yield from numbers(part, f"{path}.{name}")
    else:
        yield path, value


def scale(path: str, values: dict[str, Any]) -> float:
    """Return what a difference of a number is counted in."""
    spread = values.get(f"{path.rpartition('.')[0]}.std")
    return spread if isinstance(spread, float) else max(abs(values[path]), FLOOR)


def main(one: Path, other: Path, bound: float) -> int:
    left, right = (dict(numbers(json.loads(path.read_text(encoding="utf-8")))) for path in (one, other))
    assert left.keys() == right.keys(), left.keys() ^ right.keys()
    differences = {}
    for path, value in left.items():
        if isinstance(value, float) and isinstance(right[path], float):
            differences[path] = abs(right[path] - value) / scale(path, left)
        else:
            differences[path] = 0.0 if right[path] == value else float("inf")
    worst = max(differences, key=differences.__getitem__)
    verdict = "at most" if differences[worst] <= bound else "FAILS:"
    print(f"{len(differences)} values differ by {verdict} {differences[worst]:.2g} (bound {bound:g}), at {worst[1:]}")
    return int(differences[worst] > bound)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3])))
