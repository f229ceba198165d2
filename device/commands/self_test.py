"""`python -m device self-test`: open the probe, run its self-test once, print what each check found.

Exit codes: 0 no check failed, 1 one failed or a part did not open.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from device.assembly.opened_parts import StartFailed
from device.files.text_table import aligned
from device.instrument.press.states import Guidance
from device.instrument.procedure import Procedure
from device.instrument.self_test.report import CheckResult, broken, overall

EXAMPLES = """examples:
  python -m device self-test --on-block            also each LED and two presses, on the reference block when asked to
  python -m device self-test --weight-n 0.5        also a known weight
  python -m device self-test --simulate --json     the virtual probe, results as JSON
A daemon that runs holds the hardware: ask it for its self-test on the screen or with POST /api/v1/self-test.
"""
COLUMNS = ("part", "check", "verdict", "measured", "must be", "what to do")
POLL_S = 0.05
OPERATORS = (Guidance.KEEP_FREE, Guidance.HOLD_BLOCK, Guidance.PUT_WEIGHT, Guidance.TAKE_WEIGHT_OFF, Guidance.LIFT)
"""What the operator is told; the rest of the guidance is for the screen."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    # Also before the command: there they are for every command.
    parser.add_argument("--simulate", action="store_true", default=argparse.SUPPRESS, help="of the virtual probe")
    parser.add_argument("--scene", type=Path, default=argparse.SUPPRESS, metavar="FILE", help="its scene (TOML)")
    parser.add_argument(
        "--on-block", action="store_true", help="test sides and flat field, held on the reference block"
    )
    parser.add_argument("--weight-n", type=float, metavar="N", help="test the load cell with a known weight")
    parser.add_argument("--json", action="store_true", help="as one JSON object")


def run_self_test_command(options: argparse.Namespace, opener: Callable[[], Procedure]) -> int:
    """Run the self-test of the probe that `opener` opens; return the exit code.

    Raises `InvalidQuantity` for a weight that cannot be measured.
    """
    try:
        procedure = opener()
    except StartFailed as refusal:
        results: Sequence[CheckResult] = [broken("start", fault) for fault in refusal.faults]
    else:
        try:
            results = _results(procedure, on_block=options.on_block, weight_n=options.weight_n)
        finally:
            procedure.close()
    verdict = overall(results)
    if options.json:
        print(
            json.dumps(
                {
                    "simulated": options.simulate,
                    "verdict": verdict,
                    "results": [result.as_record() for result in results],
                }
            )
        )
    else:
        print("\n".join(aligned([COLUMNS, *map(_row, results)])))
        print(f"{'simulated probe' if options.simulate else 'probe'}: {verdict.replace('_', ' ')}")
    return 1 if verdict == "failed" else 0


def _results(procedure: Procedure, *, on_block: bool, weight_n: float | None) -> Sequence[CheckResult]:
    procedure.board.on_guidance(_tell)
    procedure.start()
    procedure.request_self_test(on_block=on_block, weight_n=weight_n)
    while procedure.self_test.is_under_way:
        time.sleep(POLL_S)
    return procedure.self_test.results


def _tell(guidance: Guidance) -> None:
    if guidance in OPERATORS:
        print(guidance.text, file=sys.stderr, flush=True)


def _row(result: CheckResult) -> tuple[str, ...]:
    advice = " ".join(filter(None, (result.code, result.cause, result.remedy)))
    return result.part, result.check, result.verdict.replace("_", " "), result.measured, result.bound, advice
