"""Whether a key that this probe trusts has signed: `ssh-keygen -Y verify`, asked without the clock.

OpenSSH's signatures are on every probe, work without a network and keep keys in hardware tokens; nothing here computes
a signature. A key has no dates on the probe, whose clock may show 1970: it is taken out of the list instead.
"""

from __future__ import annotations

import base64
import binascii
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from device.errors import UntrustedRelease

IDENTITY, NAMESPACE = "release@tsis", "tsis-release"
ANY_TIME = "20300101"
"""The day that ssh-keygen is told it is: no key has dates, and so no day matters but that it is always the same."""
BEGIN, END = "-----BEGIN SSH SIGNATURE-----\n", "-----END SSH SIGNATURE-----\n"
COLUMNS = 70
WITHIN_S = 30
REMEDY = "Take the release file from its maker again, and copy it again."


def require_signature(content: bytes, signature: bytes, signers: Path) -> None:
    """Raise `UntrustedRelease` unless a key of the file `signers` has signed exactly these bytes as a release."""
    _require_canonical(signature)
    try:
        require_signers(signers.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        cause = f"This probe cannot say whom it trusts: {error}."
        raise UntrustedRelease(cause, f"Put the makers' public keys into {signers} (`make provision`).") from None
    said = _verify(content, signature, signers)
    if said is not None:
        cause = f"The release is not signed by a key that this probe trusts ({said})."
        raise UntrustedRelease(cause, REMEDY)


def require_signers(text: str) -> None:
    """Raise `ValueError` unless a text lists keys as an allowed-signers file, for our identity and without dates."""
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if not lines:
        raise ValueError("the list of signers is empty")
    for number, line in enumerate(lines, 1):
        _require_signer(line.split(), f"line {number} of the list of signers")


def _require_signer(words: list[str], where: str) -> None:
    kinds = [index for index, word in enumerate(words) if word.startswith(("ssh-", "sk-", "ecdsa-"))]
    if words[0] != IDENTITY or not kinds or len(words) <= kinds[0] + 1:
        raise ValueError(f"{where} is not: {IDENTITY}, a kind of key, a key")
    if "valid-" in " ".join(words[: kinds[0]]):
        raise ValueError(f"{where} has a date, which the probe's clock cannot keep: take keys out instead")
    kind, key = words[kinds[0] : kinds[0] + 2]
    try:
        blob = base64.b64decode(key, validate=True)
    except binascii.Error:
        raise ValueError(f"{where} has a key that is not in base 64") from None
    name = kind.encode()
    if blob[: 4 + len(name)] != len(name).to_bytes(4, "big") + name:
        raise ValueError(f"{where} has a key that is not of the kind {kind}")


def _require_canonical(signature: bytes) -> None:
    """Refuse an armour that says the same in other bytes: then each byte of a release file matters."""
    text = signature.decode("ascii", errors="replace")
    try:
        blob = base64.b64decode(text.removeprefix(BEGIN).removesuffix(END).replace("\n", ""), validate=True)
    except (binascii.Error, ValueError):
        blob = b""
    code = base64.b64encode(blob).decode()
    lines = "".join(code[start : start + COLUMNS] + "\n" for start in range(0, len(code), COLUMNS))
    if not blob or text != BEGIN + lines + END:
        raise UntrustedRelease("The release's signature is damaged.", REMEDY)


def _verify(content: bytes, signature: bytes, signers: Path) -> str | None:
    """Return None when ssh-keygen says yes, else what it says. The signature is handed over without a file."""
    with _in_memory(signature) as handle:
        command = ["ssh-keygen", "-Y", "verify", "-f", str(signers), "-I", IDENTITY, "-n", NAMESPACE]
        command += ["-s", f"/proc/self/fd/{handle}", f"-Overify-time={ANY_TIME}"]
        try:
            done = subprocess.run(command, input=content, capture_output=True, pass_fds=[handle], timeout=WITHIN_S)
        except (OSError, subprocess.TimeoutExpired) as error:
            return f"ssh-keygen could not be asked: {error}"
    if done.returncode == 0:
        return None
    return " ".join((done.stderr + done.stdout).decode(errors="replace").split()) or f"exit code {done.returncode}"


@contextmanager
def _in_memory(content: bytes) -> Iterator[int]:
    handle = os.memfd_create("signature")
    try:
        os.write(handle, content)
        os.lseek(handle, 0, os.SEEK_SET)
        yield handle
    finally:
        os.close(handle)
