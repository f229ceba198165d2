"""Run the updater's command line so that one of its changes to the disk fails, or is the last before it is killed.

`killed_updater.py HOW N WORDS...`: every call that changes a folder or synchronises is counted; at the N-th the process
is killed before it (`kill`), or the call raises ENOSPC (`full`: it alone; `stays_full`: every later one too that needs
space). With `count` it only counts. What was called is written to the file TSIS_FAKE_STATE/calls, a line each.
"""

import builtins
import errno
import io
import os
import signal
import sys
from pathlib import Path

NEED_SPACE = ("fsync", "mkdir", "symlink", "open", "link")
COUNTED = (*NEED_SPACE, "replace", "rename", "unlink", "rmdir")


def main():
    how, at, words = sys.argv[1], int(sys.argv[2]), sys.argv[3:]
    seen = []

    def changes(name, original, *arguments, **keywords):
        path = os.readlink(f"/proc/self/fd/{arguments[0]}") if name == "fsync" else arguments[0]
        if "progress.json" in str(path):  # how often that is written depends on the time
            return original(*arguments, **keywords)
        seen.append(f"{name} {path}")
        if how == "kill" and len(seen) == at:
            os.kill(os.getpid(), signal.SIGKILL)
        is_hit = len(seen) == at if how == "full" else how == "stays_full" and len(seen) >= at
        if is_hit and name in NEED_SPACE:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return original(*arguments, **keywords)

    for name in COUNTED:
        if name != "open":
            patch(os, name, changes)
    patch_open(changes)
    from device.update.__main__ import main as update

    try:
        code = update(words)
    finally:
        Path(os.environ["TSIS_FAKE_STATE"], "calls").write_text("\n".join(seen))
    return code


def patch(module, name, changes):
    original = getattr(module, name)
    setattr(module, name, lambda *arguments, **keywords: changes(name, original, *arguments, **keywords))


def patch_open(changes):
    """Count files that are opened to be written; those of the test itself are not."""
    original = io.open

    def opening(file, mode="r", *arguments, **keywords):
        if isinstance(file, int) or not set(mode) & set("wxa") or str(file).endswith("/calls"):
            return original(file, mode, *arguments, **keywords)
        return changes("open", original, file, mode, *arguments, **keywords)

    io.open = builtins.open = opening


if __name__ == "__main__":
    sys.exit(main())
