"""Ctrl-C ends a command without a traceback, also while its modules are still being imported.

Imported before anything else by the command line: loading takes longer than a change of mind.
"""

from __future__ import annotations

import signal
import sys
from types import FrameType, TracebackType

LOADING = "<frozen importlib._bootstrap>"
"""The file of the code that loads modules, on the stack while one is loaded."""


def interrupt(number: int, frame: FrameType | None) -> None:
    """Raise `KeyboardInterrupt` as Python does, but end the process where a module is being loaded.

    Some modules swallow whatever is raised while they load others (ngsolve, netgen.occ): the command would go on.
    """
    while frame is not None and frame.f_code.co_filename != LOADING:
        frame = frame.f_back
    if frame is not None:
        signal.signal(number, signal.SIG_DFL)
        signal.raise_signal(number)
    raise KeyboardInterrupt


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
if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # a job in the background ignores it
    signal.signal(signal.SIGINT, interrupt)
