"""The size of a pixel on the sensing face: whatever has a length in an image goes through it.

Pixels are not square. NumPy is loaded by what computes coordinates alone: the settings hold a scale, too, and what
darkens the LEDs by them has to be quick (device/commands/led_off.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from device.measurement.quantities import Bound, require

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class PixelScale:
    """Size of a pixel on the sensing face in mm; the two differ on the paper's camera by 17 %."""

    mm_per_px_x: float
    mm_per_px_y: float

    def __post_init__(self) -> None:
        for name in ("mm_per_px_x", "mm_per_px_y"):
            require(name, getattr(self, name), Bound(1e-4, 1.0, "mm"), "give the calibrated pixel size")

    @property
    def area_mm2(self) -> float:
        """Area of one pixel."""
        return self.mm_per_px_x * self.mm_per_px_y

    def coordinates_mm(self, shape: tuple[int, int]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return x [1, width] and y [height, 1] of the pixel centres, 0 in the middle of the image."""
        import numpy as np

        height, width = shape
        x = (np.arange(width, dtype=np.float32) - (width - 1) / 2) * self.mm_per_px_x
        y = (np.arange(height, dtype=np.float32) - (height - 1) / 2) * self.mm_per_px_y
        return x[None, :], y[:, None]
