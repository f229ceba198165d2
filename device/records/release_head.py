"""The beginning of a release file, looked at while the rest is still to come: is it one of this product at all?

Nothing is trusted by it; that the file is signed and whole, the updater finds out before it unpacks anything.
Source: POSIX.1-2017, pax, "ustar Interchange Format": blocks of 512 bytes, each member behind a header of one block.
"""

from __future__ import annotations

import json
import tarfile

from device.errors import InvalidRequest

MANIFEST = "manifest.json"
LONGEST_MANIFEST_BYTES = 1_000_000
REMEDY = "Send the file NAME.release that `make bundle` built, unchanged."


class ReleaseHead:
    """Takes the first bytes of a file until its manifest is there; raises `InvalidRequest` when there is none."""

    def __init__(self) -> None:
        """Begin with nothing seen."""
        self._seen, self._needed_bytes = b"", tarfile.BLOCKSIZE
        self.is_complete = False

    def see(self, part: bytes) -> None:
        """Take the next bytes; raise `InvalidRequest` as soon as they are not those of a release of this product."""
        if self.is_complete:
            return
        self._seen += part[: LONGEST_MANIFEST_BYTES + tarfile.BLOCKSIZE - len(self._seen)]
        if self._needed_bytes == tarfile.BLOCKSIZE <= len(self._seen):
            self._needed_bytes += _manifest_bytes(self._seen[: tarfile.BLOCKSIZE])
        if self._needed_bytes > tarfile.BLOCKSIZE and len(self._seen) >= self._needed_bytes:
            _require_ours(self._seen[tarfile.BLOCKSIZE : self._needed_bytes])
            self.is_complete, self._seen = True, b""

    def require_complete(self) -> None:
        """Raise `InvalidRequest` when the file ended before its manifest did."""
        if not self.is_complete:
            raise InvalidRequest("The file is too short for a release file.", REMEDY)


def _manifest_bytes(block: bytes) -> int:
    """Return the size of the manifest that a header announces."""
    try:
        member = tarfile.TarInfo.frombuf(block, "utf-8", "strict")
    except (tarfile.HeaderError, UnicodeDecodeError) as error:
        raise InvalidRequest("The file is no release file: it is no tar archive.", REMEDY) from error
    if member.name != MANIFEST or not member.isreg():
        cause = f"The file is no release file: it begins with {member.name[:80]!r}, not with {MANIFEST}."
        raise InvalidRequest(cause, REMEDY)
    if not 0 < member.size <= LONGEST_MANIFEST_BYTES:
        cause = f"The manifest has {member.size} bytes, but must have 1 to {LONGEST_MANIFEST_BYTES}."
        raise InvalidRequest(cause, REMEDY)
    return member.size


def _require_ours(content: bytes) -> None:
    try:
        manifest = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise InvalidRequest("The manifest of the file is no JSON document.", REMEDY) from error
    if not isinstance(manifest, dict) or manifest.get("product") != "tsis":
        product = str(manifest.get("product"))[:80] if isinstance(manifest, dict) else "nothing"
        raise InvalidRequest(f"The file is a release of {product!r}, not of this product, 'tsis'.", REMEDY)
