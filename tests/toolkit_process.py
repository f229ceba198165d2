"""The toolkit's command line as a researcher types it; in this process, since another one loads everything anew."""

import io
import os
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from unittest.mock import patch

from daemon_process import ROOT

from host_tools.__main__ import main


@dataclass(frozen=True)
class Done:
    """Exit code and output of a command that has ended."""

    returncode: int
    stdout: str
    stderr: str


def run_toolkit(*arguments: object, cwd=ROOT) -> Done:
    """Run `host_tools` with arguments in a wide terminal; an error that `main` does not put into words is raised."""
    told, noted, code = io.StringIO(), io.StringIO(), 0
    words = ["host_tools", *map(str, arguments)]
    with (
        chdir(cwd), patch.dict(os.environ, COLUMNS="200"), patch.object(sys, "argv", words),
        redirect_stdout(told), redirect_stderr(noted),
    ):  # fmt: skip
        try:
            main()
        except SystemExit as end:
            code = int(end.code or 0)
    return Done(code, told.getvalue(), noted.getvalue())
