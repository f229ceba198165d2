"""The disk below the store to a verdict: what is left of it, and whether it gives back what it took."""

from __future__ import annotations

import os

from device.errors import StorageError
from device.instrument.self_test.result import Result, broken, judged
from device.measurement.quantities import Bound
from device.records.store import Store

PART = "Storage"
PROBE_BYTES = 2**18
WHOLE = Bound(float("-inf"), 0.0, "bytes wrong")


def disk_results(store: Store, min_free_mb: float) -> list[Result]:
    """Return the space that is left, and how much of a file that was written, synchronised and read is wrong."""
    return [_free_space(store, min_free_mb), _read_back(store)]


def _free_space(store: Store, min_free_mb: float) -> Result:
    bound = Bound(min_free_mb, float("inf"), "MB")
    try:
        return judged(PART, "free space", store.free_mb, bound, "Copy recordings away and delete them there.")
    except StorageError as error:
        return broken("free space", error)


def _read_back(store: Store) -> Result:
    content = os.urandom(PROBE_BYTES)
    try:
        found = store.read_back(content)
    except StorageError as error:
        return broken("write and read", error)
    wrong = abs(len(found) - len(content)) + sum(a != b for a, b in zip(found, content, strict=False))
    return judged(PART, "write and read", wrong, WHOLE, "Save the recordings and have the disk replaced.")
