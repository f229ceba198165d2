"""`make deploy`: a release file, verified here, goes to a probe, which installs it and says what became of it.

The account on the probe can do nothing else, whatever it is asked for; and the probe verifies all of it again.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from host_tools.release.release_file import checked_manifest
from host_tools.release.remote_machine import NotReachable, RemoteMachine

ACCOUNT = "tsis-deploy"
PUBLIC_KEY = re.compile(r"^(?!#).*?\s(?:ssh-|sk-|ecdsa-)\S+\s+(\S+)", re.MULTILINE)
END = 8
"""Characters of a public key by which it is known again."""
LOST = (
    "The connection is lost. Had the file arrived whole, the probe goes on by itself: its screen and "
    "GET /api/v1/updates say how it ended. Had it not, the probe has refused it. Sending it again does no harm."
)


def send_release(
    file: Path, signers: Path, machine: RemoteMachine, told: Callable[[str], None], *, is_checked_here: bool = True
) -> bool:
    """Send a release file and follow it to its end; return whether the probe has committed it.

    Raises `InvalidQuantity` for a file that no key in the list `signers` has signed or that is not whole; without
    `is_checked_here` the probe is left to find that out. Raises `NotReachable`.
    """
    if is_checked_here:
        manifest = checked_manifest(file, signers.read_text(encoding="utf-8"))
        named = f"release {manifest['version']}+{manifest['counter']}, {manifest['machine']}"
        told(f"{file.name}: {named}, signed and whole; {_trusted_after(manifest['signers'])}")
    told(f"sending {file.stat().st_size / 1e6:.1f} MB to {machine}")
    try:
        code = machine.run(stdin=file, told=told)
    except NotReachable as error:
        raise NotReachable(f"{error} {LOST}") from error
    told("committed" if code == 0 else f"not committed (exit code {code}): the reason stands above")
    return code == 0


def _trusted_after(signers: str) -> str:
    """Return whose releases the probe takes after this one: a change of keys that was forgotten is seen here."""
    keys = [key[-END:] for key in PUBLIC_KEY.findall(signers)]
    return f"the probe then trusts the keys that end with {', '.join(keys)} alone" if keys else "keys stay as they are"
