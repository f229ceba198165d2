"""Ctrl-C ends a command without a traceback, also while its modules are still being imported.

Imported before anything else by the command line: loading takes longer than a change of mind.
"""

from __future__ import annotations

import sys
from types import TracebackType


def without_traceback(kind: type[BaseException], error: BaseException, traceback: TracebackType | None) -> None:
    """Tell an uncaught exception as Python does; nothing of an interrupt, or of what failed because of one."""
    if not _is_interrupted(error):
        sys.__excepthook__(kind, error, traceback)


def _is_interrupted(error: BaseException | None) -> bool:
    """Return whether an exception is an interrupt, or was raised while one was handled: an import it cut short."""
    if error is None:
        return False
    return isinstance(error, KeyboardInterrupt) or _is_interrupted(error.__cause__ or error.__context__)


sys.excepthook = without_traceback
