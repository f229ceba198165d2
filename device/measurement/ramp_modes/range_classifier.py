"""Whether an inclusion lies inside the trained ranges at all: by networks that have seen inclusions around them, too.

The fit of the forward model ends where the ranges do, and explains an inclusion beyond by another one inside, of other
depth and modulus. These networks know both, so they tell what of it can be told: one output for each ramp mode, the log
odds that size or depth lies outside. Source: Neyman & Pearson, Phil. Trans. R. Soc. A 231 (1933); `docs/modes.md`.
"""

from __future__ import annotations

from device.measurement.arrays import Array
from device.measurement.bundle import BundleFiles, GoldenVectors, ModelCard, Network
from device.measurement.mode import Mode

RANGE_FILE, ENTRY = "range.onnx", "range"
"""The file in the folder of a bundle, and its entry in the card: `sha256`, and `golden` log odds of each mode for the
golden features of the bundle."""


class RangeClassifier:
    """The verified networks of a bundle."""

    def __init__(self, files: BundleFiles, card: ModelCard, features: int, modes: tuple[Mode, ...]) -> None:
        """Verify the networks that read so many features, for modes; raises `BundleRefused` when they do not hold."""
        content = files.verified(RANGE_FILE, card.of(ENTRY, dict).get("sha256"))
        outputs: dict[str, int] = dict.fromkeys(modes, 1)
        self._network = Network(files.folder, RANGE_FILE, content, features, outputs)
        self._golden = GoldenVectors.of_card(card, f"{ENTRY}.golden", features, outputs, floor=1.0)
        self.prove()

    def log_odds(self, rows: Array, mode: Mode) -> Array:
        """Return the log odds [n] that size or depth lies outside its range, for profile rows [n, P] of a mode."""
        return self._network.run(rows)[mode][:, 0]

    def prove(self) -> None:
        """Run the golden vectors; raise `BundleRefused` when one of them does not hold."""
        self._golden.prove(self._network)
