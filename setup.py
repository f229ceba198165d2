"""Puts the files that come with the program into the wheel; all else that setuptools needs is in pyproject.toml."""

import shutil
import sys
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).resolve().parent
sys.path.insert(0, str(ROOT))  # an isolated build does not look here

from device.files.shipped import FOLDERS, IN_WHEEL  # noqa: E402


class BuildWithShippedFiles(build_py):
    """Copies each folder of `FOLDERS` beside the packages' modules; an editable install leaves them where they are."""

    def run(self) -> None:
        """Build the packages, then fill `IN_WHEEL` anew: what an earlier build left there is not of this one."""
        super().run()
        if self.editable_mode:
            return
        into = Path(self.build_lib, IN_WHEEL)
        shutil.rmtree(into, ignore_errors=True)
        for name, folder in FOLDERS.items():
            shutil.copytree(ROOT / folder, into / name)


setup(cmdclass={"build_py": BuildWithShippedFiles})
