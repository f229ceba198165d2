"""Are answers the same before and after a change: 200 seeded presses, answered by the source tree that is imported.

    python tests/answers_of_presses.py --json after.json
    git worktree add /tmp/before HEAD~1
    PYTHONPATH=/tmp/before python tests/answers_of_presses.py --json before.json
    python tests/answers_of_presses.py --compare before.json

100 presses of mode standard and 100 scans of two presses of mode precise, drawn as for training from the committed
model's own rows, with noise. `--compare FILE` answers them anew and prints by how much the means of size, depth and
modulus moved, in spreads that the file states: the largest, what 95 % stay below, and root mean square. Exit code 1
when one moved by more than a hundredth of its spread, or when the presses are not the same. `--sampler-seed 7` draws
other samples of the posteriors: by how much answers move that nothing has changed. That is no failure.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, os.environ.get("PYTHONPATH") or str(Path(__file__).resolve().parents[1]))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from device.files.bundle_file import read_ramp_model
from device.files.shipped import MODELS
from device.measurement.arrays import Array
from device.measurement.parameters import PARAMETERS, normalise
from device.measurement.ramp_modes import posterior
from device.measurement.ramp_modes.model import RampModel
from host_tools.press_models.noisy_presses import random_scan
from host_tools.press_models.press_samples import draw_parameters

COUNT, SEED, SECOND_MM = 100, 1, 5.0
"""Presses of each mode; the second press of a scan lies so far off the inclusion's middle."""
OFFSETS_MM = {"standard": (), "precise": (SECOND_MM,)}
ALLOWED = 0.01
"""Of the stated spread."""
SAME_PRESSES = 1e-6
"""Rows of the same press agree so far, relative to their size: the surrogate itself may be summed in another order."""
Answers = dict[str, list[dict[str, Any]]]


def answers(model: RampModel, count: int = COUNT) -> Answers:
    """Return mean [3] and spread [3] of the unknowns' coordinates of each press, by mode, and the size of its rows."""
    return {
        mode: [_answer(model, mode, number, at) for number, at in enumerate(_drawn(count, which))]
        for which, mode in enumerate(OFFSETS_MM)
    }


def _drawn(count: int, which: int) -> Array:
    return normalise(draw_parameters(count, np.random.default_rng([SEED, which])))


def _answer(model: RampModel, mode: str, number: int, at: Array) -> dict[str, Any]:
    rng = np.random.default_rng([SEED, number])
    own_mm = at[PARAMETERS.index("offset_mm")] + 1  # coordinate -1 is the middle, 1 lies 2 mm off
    offsets_mm = np.array([own_mm, *OFFSETS_MM[mode]])
    rows, direction_rad = random_scan(model.answers.surrogate, model.answers.noise, at, offsets_mm, rng)
    answer = model.answer(rows, direction_rad)
    return {"mean": answer.mean.tolist(), "spread": answer.spread.tolist(), "rows": float(np.linalg.norm(rows))}


def moved(before: Answers, after: Answers) -> dict[str, Array]:
    """Return by how much means moved [n, 3], in spreads of `before`, by mode; raise `ValueError` for other presses."""
    by_mode = {}
    for mode, olds in before.items():
        rows = [[one["rows"] for one in part] for part in (olds, after[mode])]
        if len(rows[0]) != len(rows[1]) or not np.allclose(*rows, rtol=SAME_PRESSES, atol=0.0):
            raise ValueError(f"mode {mode}: these are not the same presses; was the model trained anew?")
        means = [np.array([one["mean"] for one in part]) for part in (olds, after[mode])]
        by_mode[mode] = np.abs(means[1] - means[0]) / np.array([one["spread"] for one in olds])
    return by_mode


def main(arguments: Sequence[str] | None = None) -> int:
    """Answer the presses; write and compare what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the answers there")
    parser.add_argument("--compare", type=Path, metavar="FILE", help="print by how much they moved since such a file")
    seed_help = "draw the posteriors' samples by this seed, to compare: what moves then is no change, and no failure"
    parser.add_argument("--sampler-seed", type=int, metavar="N", help=seed_help)
    asked = parser.parse_args(arguments)
    if asked.sampler_seed is not None:
        if not asked.compare:
            parser.error("--sampler-seed has nothing to compare with: give --compare FILE")
        posterior.SEED = asked.sampler_seed
    found = answers(read_ramp_model(MODELS / "standard"))
    if asked.json:
        asked.json.write_text(json.dumps(found) + "\n", encoding="utf-8")
    if not asked.compare:
        return 0
    try:
        by_mode = moved(json.loads(asked.compare.read_text(encoding="utf-8")), found)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    for mode, ratios in by_mode.items():
        figures = np.max(ratios), np.quantile(ratios, 0.95), np.sqrt(np.mean(ratios**2))
        print("{:9} {} presses: largest {:.2g}, 95 % {:.2g}, RMS {:.2g} spreads".format(mode, len(ratios), *figures))
    return int(asked.sampler_seed is None and max(ratios.max() for ratios in by_mode.values()) > ALLOWED)


if __name__ == "__main__":
    sys.exit(main())
