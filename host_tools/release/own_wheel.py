"""Our own wheel, the same bytes wherever it is built.

Nothing in it is compressed, since another zlib would compress otherwise; the time of every member is the commit's; and
the version of setuptools, which a wheel names, is pinned in requirements/all.lock.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from device.measurement.quantities import InvalidQuantity
from host_tools.release.checkout import Checkout

VERSION_LINE = re.compile(r'^__version__ = "([^"]+)"$', re.MULTILINE)
VERSION_FILE = Path("device", "__init__.py")
CHANGED = "+changed"
"""Ends the version of a wheel that no commit has, in the form of PEP 440."""


def built_wheel(checkout: Checkout, into: Path) -> Path:
    """Build the wheel of a checkout into a folder; return its file.

    That of a checkout with changes says so in its version, also to the daemon that runs from it.
    """
    with TemporaryDirectory(prefix="tsis-wheel-") as folder:
        sources, built = Path(folder, "sources"), Path(folder, "built")
        checkout.copy(sources)
        if checkout.changed:
            _mark_as_changed(sources / VERSION_FILE)
        _run_pip(sources, built, checkout.time_s)
        return Path(shutil.copy(next(built.glob("*.whl")), into))


def _run_pip(sources: Path, built: Path, time_s: int) -> None:
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check"]
    command += ["--no-deps", "--no-build-isolation", "--no-index", "--no-cache-dir"]
    command += ["--config-settings=--build-option=--compression=stored", "--wheel-dir", str(built), str(sources)]
    fixed = {"SOURCE_DATE_EPOCH": str(time_s), "PYTHONHASHSEED": "0"}
    done = subprocess.run(
        command, env=os.environ | fixed, umask=0o022, capture_output=True, text=True, check=False
    )  # the mode of a member is that of its file
    if done.returncode:
        raise InvalidQuantity("wheel", "not built", "built", f"pip says: {done.stderr.strip()}")


def version_of(checkout: Checkout) -> str:
    """Return the version that the wheel of a checkout has."""
    stated = VERSION_LINE.search((checkout.root / VERSION_FILE).read_text(encoding="utf-8"))
    assert stated  # pyproject.toml reads the same line
    return stated[1] + (CHANGED if checkout.changed else "")


def _mark_as_changed(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    path.write_text(VERSION_LINE.sub(rf'__version__ = "\g<1>{CHANGED}"', text), encoding="utf-8")
