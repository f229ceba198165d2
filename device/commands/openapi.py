"""`python -m device openapi`: the REST API as its OpenAPI document, which docs/openapi.json is.

Exit code 0; 1 when a file that was to be checked is another.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any, cast

from device.web.app import create_app

EXAMPLES = """examples:
  python -m device openapi > docs/openapi.json
  python -m device openapi --check docs/openapi.json
"""


def document() -> str:
    """Return the document as text."""
    nobody = cast(Any, None)  # to describe the API nothing of a probe is asked
    return json.dumps(create_app(nobody, nobody).openapi(), indent=1) + "\n"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    parser.add_argument("--check", type=Path, metavar="FILE", help="say whether a file is this document")


def run(options: argparse.Namespace) -> int:
    """Print the document, or compare a file with it; return the exit code."""
    if options.check is None:
        print(document(), end="")
        return 0
    if options.check.is_file() and options.check.read_bytes() == document().encode():
        return 0
    remedy = f"python -m device openapi > {options.check}"
    print(f"{options.check} is not what the API is. If that was meant to change: {remedy}", file=sys.stderr)
    return 1
