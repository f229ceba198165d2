"""Which tests are long: those with the mark, and those that a run has measured to be (tests/long_tests.txt).

`make test` leaves them out, so that it ends within four minutes; `make test-all` runs them all. A claim that only a
long test shows is kept by `KEPT`. Measure anew, on a quiet machine, after many tests were added:

    python -m pytest -n auto -m "not long" --junitxml=build/tests.xml; python tests/long_tests.py build/tests.xml

adds to the list what took longer than `LONGEST_S`. What the list names and is there no more fails a test.
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ElementTree
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LIST = Path(__file__).with_suffix(".txt")
LONGEST_S = 1.0
KEPT = (
    "tests/browser/test_foreign_page.py::",
    "tests/browser/test_screen.py::test_a_new_user_presses_the_simulated_probe_and_reads_the_result",
    "tests/browser/test_screen_exams.py::test_a_scanner_fills_in_the_patient_and_its_enter_presses_nothing",
    "tests/device/dicom/test_delivery.py::test_an_exam_arrives_bit_by_bit_as_it_was_written_and_is_confirmed",
    "tests/device/instrument/press/test_thousand_hands.py::",
    "tests/device/measurement/test_arrays.py::",
    "tests/device/test_modes.py::test_a_hold_has_as_many_frames_as_its_mode_needs",
    "tests/device/test_scenarios.py::test_a_probe_without_a_fault_raises_none",
    "tests/device/update/test_install.py::test_the_next_one_takes_its_place_and_the_one_before_the_last_goes",
    "tests/host_tools/commands/test_simulate.py::test_a_scene_file_is_solved_and_options_change_it",
    "tests/host_tools/forward/test_ladder.py::test_what_is_stated_is_within_what_was_asked",
    "tests/host_tools/press_models/test_confidence_belts.py::",
    "tests/host_tools/verification/test_effectivity.py::",
    "tests/physics/test_scene_rates.py::",
    "tests/test_glossary.py::",
    "tests/test_light_cut.py::test_a_killed_daemon_is_dark_before_anything_is_started_for_it",
    "tests/test_network.py::test_another_machine_is_answered_by_tls_and_with_a_token_alone",
    "tests/test_press_to_result.py::test_a_kill_loses_no_measurement",
    "tests/test_press_to_result.py::test_a_press_ends_in_a_measurement",
)
"""Beginnings of tests that `make test` runs whatever they take: each is the one way through its room, or the first of
a file in which each is short and the first one reads for all."""


def listed() -> frozenset[str]:
    """Return the tests of the list: whole names, functions with all of their parameters, or files.

    A file stands there by hand, where what is set up once for all of its tests is what takes long.
    """
    return frozenset(LIST.read_text(encoding="utf-8").splitlines())


def is_listed(name: str, names: frozenset[str]) -> bool:
    """Return whether a test, as pytest names it, is in a list."""
    return not names.isdisjoint((name, name.split("[", 1)[0], name.split("::", 1)[0]))


def measured(report: Path) -> dict[str, float]:
    """Return the seconds of each test in a report that `--junitxml` wrote."""
    cases = ElementTree.parse(report).getroot().iter("testcase")
    return {_name(case.attrib["classname"], case.attrib["name"]): float(case.attrib["time"]) for case in cases}


def _name(classname: str, test: str) -> str:
    """Return a test's name as pytest has it: the report has dots where that has folders, files and classes."""
    parts = classname.split(".")
    file = next(number for number, part in enumerate(parts) if part.startswith("test_"))
    return "::".join(["/".join(parts[: file + 1]) + ".py", *parts[file + 1 :], test])


def long_ones(seconds: Mapping[str, float]) -> list[str]:
    """Return the tests to be listed; a function all of whose parameters are long stands there once."""
    of_function: dict[str, list[str]] = defaultdict(list)
    for name in seconds:
        of_function[name.split("[", 1)[0]].append(name)
    found: list[str] = []
    for function, names in of_function.items():
        long = [name for name in names if seconds[name] > LONGEST_S and not name.startswith(KEPT)]
        found += [function] if long and len(long) == len(names) else long
    return found


def main(reports: Iterable[str]) -> None:
    """Add what reports have measured to the list."""
    found = {name for report in reports for name in long_ones(measured(Path(report)))}
    LIST.write_text("".join(f"{name}\n" for name in sorted(found | (listed() if LIST.exists() else frozenset()))))


if __name__ == "__main__":
    main(sys.argv[1:])
