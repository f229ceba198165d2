"""`python3 -m device.fallback`: serve the port of a daemon that does not run. The unit: tsis-fallback.service."""

from __future__ import annotations

import argparse
import logging
import signal
import sys
import threading
from pathlib import Path

from device.fallback.server import serve_until


def main() -> int:
    """Serve until SIGTERM or SIGINT; return the exit code."""
    parser = argparse.ArgumentParser(prog="python3 -m device.fallback", description=__doc__)
    parser.add_argument("--root", type=Path, metavar="DIR", default=Path("/"), help="folder that stands for /")
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    serve_until(stop, options.root)
    return 0


if __name__ == "__main__":
    sys.exit(main())
