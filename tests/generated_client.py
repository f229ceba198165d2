"""The client that openapi-python-client makes of docs/openapi.json, as an integrator would have it."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

from daemon_process import ROOT

PACKAGE = "tsis_client"
BINARY = (
    "image/png", "application/zip", "application/pdf", "application/x-npz", "application/x-netcdf",
    "multipart/x-mixed-replace",
)  # fmt: skip
CONFIGURATION = {"post_hooks": [], "content_type_overrides": dict.fromkeys(BINARY, "application/octet-stream")}
"""What docs/contracts.md tells an integrator: bytes stay bytes."""


@contextmanager
def generated_client(folder: Path) -> Iterator[ModuleType]:
    """Generate the client into an empty folder; give its package, which is known to Python for so long."""
    told = folder / "client.json"  # JSON is YAML, too
    told.write_text(json.dumps(CONFIGURATION))
    made = subprocess.run(
        [
            sys.executable, "-m", "openapi_python_client", "generate", "--meta", "none", "--fail-on-warning",
            "--path", ROOT / "docs" / "openapi.json", "--config", told, "--output-path", folder / PACKAGE,
        ],
        check=False, capture_output=True, text=True,
    )  # fmt: skip
    assert made.returncode == 0, made.stdout + made.stderr
    sys.path.insert(0, str(folder))
    try:
        yield importlib.import_module(PACKAGE)
    finally:
        sys.path.remove(str(folder))
        for name in [name for name in sys.modules if name.split(".")[0] == PACKAGE]:
            del sys.modules[name]
