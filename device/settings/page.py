"""The catalogue of settings as the page docs/settings.md."""

from __future__ import annotations

from pathlib import Path

from device.files.shipped import MODELS
from device.settings.catalogue import SETTINGS, Known

PAGE = """# Settings

This page answers what can be set, in which file, and within which bounds.
Written by `python -m device config show --markdown > docs/settings.md`.
A setting is written in a TOML file under its section: `press.target_n` is `target_n = 0.5` below `[press]`.
What is out of its range is refused, never clipped.

## Files

Each setting comes from the last of these that sets it:

1. the default below,
2. `/usr/lib/tsis/config.toml`, of the vendor, never edited,
3. `/etc/tsis/config.toml`,
4. `/etc/tsis/config.d/*.toml`, in the order of their names,
5. the file of `--config FILE`.

All of them have to hold, and to fit together, before any is used: else the start
is refused with every problem of every file, each with file, setting, value, bound and hint.
The simulated probe has settings of its own; `--simulate --config FILE` reads that file alone.
`--root DIR` takes the files of 2 to 4 from below another folder.

`python -m device config check` prints the problems of these files, or of the files that it is given,
before the daemon is started.
Of the installed files it also tells, with its code, each fault of models and certificate with which no daemon starts:
another probe's, one that is not there, or those of two commissionings. No hardware is opened.
In JSON they are `faults`, each `{code, cause, remedy, ...}`, and `not_checked`, what this user cannot look at.
Run as root, it also says which certificates, keys and secrets that they name the daemon's user cannot read.
`python -m device config show --changed` prints what is not as by default, and which file says so. Both take `--json`.

After a start with good files, what they set is kept in `config.last_good.toml` in the data folder.
When the files are bad at a later start, the daemon starts with that instead, and every problem is in its log.
Warning E002 is on the screen, in the status and with each press and measurement, until a start with good files.
Without last good settings the start is refused.
A last good setting that only a newer release knows is passed over,
and one of an older release that is called otherwise now is read: both are told.

## Above all sections

"""
HEADER = "| setting | default | unit | range | what it is |\n|---|---|---|---|---|\n"


def markdown() -> str:
    """Return the page of all settings, docs/settings.md."""
    lines, section = [PAGE, HEADER], ""
    for known in SETTINGS.values():
        if known.section != section:
            section = known.section
            lines += [f"\n## {section.capitalize()}\n\n", HEADER]
        lines.append(_row(known))
    return "".join(lines)


def _row(known: Known) -> str:
    default = known.default
    if isinstance(default, Path) and default.is_relative_to(MODELS.parent):
        default = default.relative_to(MODELS.parent)  # where the program is installed is not the reader's business
    cells = known.name, known.written(default), known.unit, known.range, known.sentence
    return f"| `{cells[0]}` | `{cells[1]}` | {' | '.join(cells[2:])} |\n"
