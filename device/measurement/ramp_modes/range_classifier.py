"""Whether an inclusion lies inside the trained ranges at all: by networks that have seen inclusions around them, too.

The fit of the forward model ends where the ranges do, and explains an inclusion beyond by another one inside, of other
depth and modulus. These networks know both, so they tell what of it can be told: one output for each ramp mode, the log
odds that size or depth lies outside. Source: Neyman & Pearson, Phil. Trans. R. Soc. A 231 (1933); `docs/modes.md`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from device.measurement.arrays import Array
from device.measurement.mode import Mode
from device.measurement.model_card import BundleRefused, read_bundle_file
from device.measurement.paper_mode.inversion import GOLDEN_TOLERANCE, RUNTIME_ERRORS, open_session, verify_ports

RANGE_FILE, ENTRY = "range.onnx", "range"
"""The file in the folder of a bundle, and its entry in the card: `sha256`, and `golden` log odds of each mode for the
golden features of the bundle."""


class RangeTest:
    """The verified networks of a bundle."""

    def __init__(self, folder: Path, network: bytes, card: Mapping[str, Any], modes: tuple[Mode, ...]) -> None:
        """Use `load`: it alone reads the file. Raises `BundleRefused`."""
        self._made_of = folder, network, card, modes
        self._folder, entry = folder, card.get(ENTRY)
        if not isinstance(entry, Mapping):
            raise BundleRefused(folder, ENTRY, "missing", "in the card")
        found = hashlib.sha256(network).hexdigest()
        if found != entry.get("sha256"):
            raise BundleRefused(folder, RANGE_FILE, found, f"{entry.get('sha256')} as model.json states")
        try:
            self._session = open_session(network)
            self._rows = np.array(card["golden"]["features"], np.float64)
            self._golden = {mode: np.array(entry["golden"][mode], np.float64) for mode in modes}
        except (*RUNTIME_ERRORS, KeyError, TypeError, ValueError) as error:
            raise BundleRefused(folder, RANGE_FILE, f"unusable ({error})", "a network with golden log odds") from error
        verify_ports(folder, RANGE_FILE, self._session, self._rows.shape[-1], dict.fromkeys(modes, 1))
        self.prove()

    def __reduce__(self) -> tuple[type[RangeTest], tuple[Path, bytes, Mapping[str, Any], tuple[Mode, ...]]]:
        return RangeTest, self._made_of  # another process opens and verifies it again: a session cannot be sent

    @classmethod
    def load(cls, folder: Path, card: Mapping[str, Any], modes: tuple[Mode, ...]) -> RangeTest:
        """Return the networks of a bundle's folder for modes; raises `BundleRefused` when they do not hold."""
        return cls(folder, read_bundle_file(folder, RANGE_FILE), card, modes)

    def log_odds(self, rows: Array, mode: Mode) -> Array:
        """Return the log odds [n] that size or depth lies outside its range, for profile rows [n, P] of a mode."""
        found = self._session.run([mode], {"features": rows.astype(np.float32)})[0]
        return np.asarray(found, np.float64)[:, 0]

    def prove(self) -> None:
        """Run the golden vectors; raise `BundleRefused` when one of them does not hold."""
        for mode, expected in self._golden.items():
            found = self.log_odds(self._rows, mode)
            alike = found.shape == expected.shape
            error = float(np.max(np.abs(found - expected) / np.maximum(np.abs(expected), 1.0))) if alike else np.inf
            if not error <= GOLDEN_TOLERANCE:
                bound = f"at most {GOLDEN_TOLERANCE:g} from the golden log odds of mode {mode}"
                raise BundleRefused(self._folder, RANGE_FILE, f"{error:.2g} off", bound)
