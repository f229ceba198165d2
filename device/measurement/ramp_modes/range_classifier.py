"""Whether an inclusion lies inside the trained ranges at all: by networks that have seen inclusions around them, too.

The fit of the forward model ends where the ranges do, and explains an inclusion beyond by another one inside, of other
depth and modulus. These networks know both, so they tell what of it can be told: the log odds that size or depth lies
outside. Source: Neyman & Pearson, Phil. Trans. R. Soc. A 231 (1933); `docs/modes.md`.
"""

from __future__ import annotations

from device.measurement.arrays import Array
from device.measurement.bundle import BundleFiles, GoldenVectors, ModelCard, Network
from device.measurement.ramp_modes.radial_profile import network_rows

RANGE_FILE, ENTRY = "range.onnx", "range"
"""The file in the folder of a bundle, and its entry in the card: `sha256`, and `golden` log odds for the golden
features of the bundle."""
OWN_RANGE_FILE, OWN_ENTRY = "range_commissioned.onnx", "range_commissioned"
"""Those that have seen what a builder's tolerances allow: in the design's bundle, for commissioning to hand on."""
OUTPUT = "standard"
"""Of the network: the mode whose noise it has seen."""


class RangeClassifier:
    """The verified networks of a bundle."""

    def __init__(
        self, files: BundleFiles, card: ModelCard, features: int, file: str = RANGE_FILE, entry: str = ENTRY
    ) -> None:
        """Verify the networks that read so many features; raises `BundleRefused` when they do not hold."""
        content = files.verified(file, card.of(entry, dict).get("sha256"))
        outputs = {OUTPUT: 1}
        self._network = Network(files.folder, file, content, features, outputs)
        self._golden = GoldenVectors.of_card(card, f"{entry}.golden", features, outputs, floor=1.0)
        self.prove()

    def log_odds(self, rows: Array) -> Array:
        """Return the log odds [n] that size or depth lies outside its range, for profile rows [n, P]."""
        read: Array = network_rows(rows)
        return self._network.run(read)[OUTPUT][:, 0]

    def prove(self) -> None:
        """Run the golden vectors; raise `BundleRefused` when one of them does not hold."""
        self._golden.prove(self._network)
