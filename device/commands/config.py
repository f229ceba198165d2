"""`python -m device config`: are the settings files good, and which value does each setting have from where.

Exit codes: 0 ok, 1 a file cannot be used, one that the installed ones name cannot be read, or models and certificate
that they name do not belong together.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from device.config import Config
from device.errors import DeviceError
from device.files.file_reader import daemon_reader
from device.files.plain_settings import below, layer_files
from device.files.text_table import aligned
from device.settings.catalogue import SETTINGS, Known
from device.settings.layers import Layers, read_layers
from device.settings.named_files import named_files, unreadable_files
from device.settings.page import markdown

EXAMPLES = """examples:
  python -m device config check                    all files of this machine
  python -m device config check probe.toml         one file before it is installed
  python -m device config show --changed           what is not as by default, and which file says so
  python -m device config show --markdown          the page docs/settings.md
"""
READ_AT_START = ("paper_model", "quick_model", "standard_model", "calibration")
"""Settings that name models and certificates."""
COLUMNS = ("setting", "value", "unit", "default", "set by")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    verbs = parser.add_subparsers(dest="verb", metavar="check | show", required=True)
    check = verbs.add_parser("check", help="print every problem of every settings file; exit code 1 if there is one")
    check.add_argument("files", type=Path, nargs="*", metavar="FILE", help="these instead, one over the other")
    check.add_argument("--json", action="store_true", help="as one JSON object")
    show = verbs.add_parser("show", help="print each setting with value, unit, default and the file that sets it")
    show.add_argument("--changed", action="store_true", help="only those that are not as by default")
    form = show.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="as one JSON list")
    form.add_argument("--markdown", action="store_true", help="what there is to set: the page docs/settings.md")


def run(options: argparse.Namespace) -> int:
    """Run `config check` or `config show`; return the exit code, or raise `ConfigError` for what cannot be shown."""
    if options.verb == "show" and options.markdown:
        print(markdown(), end="")
        return 0
    installed = layer_files(options.root, options.config)
    if options.verb == "check":
        return _check(options, read_layers(options.files or installed))
    _show(read_layers(installed), only_changed=options.changed, as_json=options.json)
    return 0


def _check(options: argparse.Namespace, layers: Layers) -> int:
    """Print every problem; files that are checked before they are installed may name what is on another machine."""
    reader, are_installed = daemon_reader(), not options.files
    unreadable = unreadable_files(layers.values, reader, options.root)
    faults, notes = _at_start(layers, options.root) if are_installed and layers.files else ([], [])
    if options.json:
        problems = [problem.as_record() for problem in layers.problems]
        files, named = [str(path) for path in layers.files], [one.as_record() for one in unreadable]
        told = {"files": files, "problems": problems, "renamed": layers.renamed, "unreadable": named}
        print(json.dumps({**told, "faults": [fault.as_record() for fault in faults], "not_checked": notes}))
    else:
        is_fine = not (layers.problems or unreadable or faults)
        lines = [f"{path}: no problem" for path in layers.files] if is_fine else map(str, layers.problems)
        by_whom = [reader.note] if reader.note and named_files(layers.values) else []
        told_faults = [f"{fault.code} {fault}" for fault in faults]
        print(
            "\n".join([*lines, *layers.renamed, *map(str, unreadable), *by_whom, *told_faults, *notes])
            or "There is no settings file: the defaults hold."
        )
    return 1 if layers.problems or faults or (unreadable and are_installed) else 0


def _at_start(layers: Layers, root: Path) -> tuple[Sequence[DeviceError], list[str]]:
    """Return the faults with which a daemon of these files would not start, and what could not be looked at.

    Only this loads what measures: it takes seconds on a probe.
    """
    if layers.problems:
        return [], []
    from device.assembly.answers import faults_at_start

    config = _found_below(root, layers.config())
    named = [getattr(config, name) for name in READ_AT_START]
    if hidden := [str(path) for path in named if not _can_be_looked_at(path)]:
        told = f"Models and certificate are not checked: this user cannot read {', '.join(hidden)}. Use sudo."
        return [], [told]
    return faults_at_start(config), []


def _found_below(root: Path, config: Config) -> Config:
    """Return settings whose models and certificates are looked for below a root; those of the release are its own."""
    of_release = {name: getattr(Config, name) for name in READ_AT_START if name != "calibration"}
    named = {name: path for name in READ_AT_START if (path := getattr(config, name)) != of_release.get(name)}
    found: dict[str, Any] = {name: below(root, path) for name, path in named.items()}
    return replace(config, **found)


def _can_be_looked_at(path: Path) -> bool:
    """Return whether this user can say what is at a path; that nothing is there, too."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return True
    except OSError:
        return False
    return os.access(path, os.R_OK | (os.X_OK if path.is_dir() else 0))


def _show(layers: Layers, *, only_changed: bool, as_json: bool) -> None:
    config = layers.config()
    values = {name: known.value(config) for name, known in SETTINGS.items()}
    shown = [known for name, known in SETTINGS.items() if values[name] != known.default or not only_changed]
    if as_json:
        print(json.dumps([_record(known, values[known.name], layers) for known in shown], default=str))
    else:
        print("\n".join(aligned([COLUMNS, *(_row(known, values[known.name], layers) for known in shown)])))


def _record(known: Known, value: Any, layers: Layers) -> dict[str, Any]:
    file = layers.origins.get(known.name)
    unit = known.unit
    return {"setting": known.name, "value": value, "unit": unit, "default": known.default, "file": file}


def _row(known: Known, value: Any, layers: Layers) -> tuple[str, ...]:
    file = str(layers.origins.get(known.name, "default"))
    return known.name, known.written(value), known.unit, known.written(known.default), file
