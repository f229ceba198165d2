"""Free text to what of it can only be the program's own: for a file that leaves the house without patients' data.

A name cannot be told from a word by looking at it. So nothing is taken out; a word is let through when it stands in one
of the daemon's own sentences, or in one of Linux, SQLite or systemd that are listed here. A number is let through alone
and when it is short: dates, ids and telephone numbers are not. What is held back shows as [...].
What this cannot tell: a name that is also a word of those sentences.
"""

from __future__ import annotations

import ast
import builtins
import errno
import os
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

HELD_BACK = "[...]"
PROGRAM = Path(__file__).resolve().parents[1]
OTHERS = """
 started starting stopped stopping deactivated successfully main process exited code killed dumped status scheduled
 restart job counter is at watchdog timeout limit failed with result unit entered state service consumed cpu time
 control exec start stop post pre signal kill abrt term dependency tactile probe systemd timed out
 database disk image is malformed file not a encrypted locked unable to open attempt write readonly no such table column
 traceback most recent call last line in during handling of the above exception another occurred
 committed previous pending tries baseline floor bad history idle verifying unpacking switching checking rolled back
 error warning info critical debug none true false refused
"""
"""Words of systemd's, the updater's, SQLite's and Python's own sentences."""
WORD = re.compile(r"[A-Za-z]+")
NUMBER = re.compile(r"\d+(?:\.\d+)?")
MOST_DIGITS = 3
PLAIN_CODE = re.compile(r"E\d{3}|0x[0-9a-fA-F]{1,2}\b")
"""A fault's code, an address on the I2C bus."""
IN_THE_PROGRAM = re.compile(r'File ".*?/((?:device|host_tools)/[a-z_/]+\.py)", line (\d+), in (\w+)')
IN_A_LIBRARY = re.compile(r'File "[^"]*", line \d+, in \S+')
RELEASE = re.compile(r"\d{1,3}\.\d{1,3}\.\d{1,3}(?:\+\d{1,9})?")
TIME = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(?:\.\d+)?(?:Z|[+-]\d\d:?\d\d)")


def known_only(text: str) -> str:
    """Return a text in which what is not known is held back, line by line."""
    return "\n".join(_line(line) for line in text.splitlines())


def learn_words() -> None:
    """Read the program's own sentences now, which takes a second or more, and not in each thread that needs them."""
    _vocabulary()


def known_in(value: Any) -> Any:
    """Return a JSON value with every text in it, keys included, as `known_only` or as a release's name or a time."""
    if isinstance(value, dict):
        return {_text(str(key)): known_in(one) for key, one in value.items()}
    if isinstance(value, list):
        return [known_in(one) for one in value]
    return _text(value) if isinstance(value, str) else value


def _text(text: str) -> str:
    return text if RELEASE.fullmatch(text) or TIME.fullmatch(text) else known_only(text)


def _line(line: str) -> str:
    if found := IN_THE_PROGRAM.search(line):
        return f"  {found[1]}:{found[2]} {found[3]}" if known_only(found[3]) == found[3] else f"  {found[1]}:{found[2]}"
    if IN_A_LIBRARY.search(line):
        return "  in a library"
    shown: list[str] = []
    for word in line.split():
        told = word if _is_known(word) else HELD_BACK
        if told != HELD_BACK or shown[-1:] != [HELD_BACK]:
            shown.append(told)
    return " ".join(shown)


def _is_known(word: str) -> bool:
    if not word.isascii():
        return False
    rest = PLAIN_CODE.sub("", word)
    numbers = NUMBER.findall(rest)
    if len(numbers) > 1 or any(len(number.partition(".")[0]) > MOST_DIGITS for number in numbers):
        return False
    return all(part.lower() in _vocabulary() for part in WORD.findall(rest))


@cache
def _vocabulary() -> frozenset[str]:
    """Return the words of the daemon's sentences and modules; without its sources, of the others alone."""
    texts = [OTHERS, *(os.strerror(number) for number in errno.errorcode), *errno.errorcode.values()]
    texts += dir(builtins)
    for path in PROGRAM.rglob("*.py"):
        texts += [*path.relative_to(PROGRAM.parent).with_suffix("").parts, *_sentences(path)]
    return frozenset(word.lower() for text in texts for word in WORD.findall(text))


def _sentences(path: Path) -> Iterator[str]:
    """Yield the texts of a module, without its docstrings: these name people and books."""
    try:
        tree = ast.parse(path.read_text(encoding="utf-8"))
    except (OSError, SyntaxError, ValueError):
        return
    alone = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in alone:
            yield node.value
        elif isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield re.sub(r"(?<=[a-z])(?=[A-Z])", " ", node.name)
            yield node.name
