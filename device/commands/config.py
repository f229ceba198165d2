"""`python -m device config`: are the settings files good, and which value does each setting have from where.

Exit codes: 0 ok, 1 a file cannot be used.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from device.files.plain_settings import layer_files
from device.files.text_table import aligned
from device.settings.catalogue import SETTINGS, Known
from device.settings.layers import Layers, read_layers
from device.settings.page import markdown

EXAMPLES = """examples:
  python -m device config check                    all files of this machine
  python -m device config check probe.toml         one file before it is installed
  python -m device config show --changed           what is not as by default, and which file says so
  python -m device config show --markdown          the page docs/settings.md
"""
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
        return _check(read_layers(options.files or installed), as_json=options.json)
    _show(read_layers(installed), only_changed=options.changed, as_json=options.json)
    return 0


def _check(layers: Layers, *, as_json: bool) -> int:
    if as_json:
        problems = [problem.as_record() for problem in layers.problems]
        files = [str(path) for path in layers.files]
        print(json.dumps({"files": files, "problems": problems, "renamed": layers.renamed}))
    elif layers.problems:
        print("\n".join([*map(str, layers.problems), *layers.renamed]))
    else:
        lines = [f"{path}: no problem" for path in layers.files] + list(layers.renamed)
        print("\n".join(lines) or "There is no settings file: the defaults hold.")
    return 1 if layers.problems else 0


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
