"""What the instrument asks of its hardware: set the light, take a frame, read the force.

Raw and calibrated are different types: a load cell gives `CellCounts`, and only a `ForceScale` makes `Newtons` of
them. Both are plain floats while the program runs; it is the type check that keeps one from being taken for the other.
All times are seconds of the one monotonic clock (`time.monotonic`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NewType, Protocol

from device.measurement.recording.led_sides import SIDES, LedRatio

if TYPE_CHECKING:  # what darkens the LEDs has to be quick (device/commands/led_off.py)
    import numpy as np
    from numpy.typing import NDArray

LED_COUNT = len(SIDES)

CellCounts = NewType("CellCounts", float)
"""What the load cell's converter reads, its zero and all."""
Newtons = NewType("Newtons", float)
"""Normal force, positive when the probe is pressed."""


@dataclass(frozen=True)
class CameraFrame:
    """One exposure, untouched: counts [height_px, width_px], and when and how it was taken."""

    counts: NDArray[np.uint8]
    exposure_start_s: float
    exposure_us: float
    gain: float


@dataclass(frozen=True)
class CellSample:
    """One reading of the load cell in ADC counts, and when it was measured."""

    t_s: float
    counts: CellCounts


@dataclass(frozen=True)
class ForceScale:
    """Turns load-cell counts into newtons: (counts - tare) / sensitivity."""

    sensitivity_counts_per_n: float
    tare_counts: CellCounts

    def newtons(self, counts: CellCounts) -> Newtons:
        """Return the normal force in N, positive when the probe is pressed."""
        return Newtons((counts - self.tare_counts) / self.sensitivity_counts_per_n)


@dataclass(frozen=True)
class ComputerState:
    """What the probe's computer says of itself; None for what it cannot say.

    `is_supply_low`: whether its supply voltage was too low at some time in the last two seconds.
    `is_clock_set`: whether its clock, since it was switched on, has been set by a time server or a battery clock.
    """

    is_supply_low: bool | None = None
    temperature_c: float | None = None
    is_clock_set: bool | None = None


class Computer(Protocol):
    """The computer that the daemon runs on."""

    def read(self) -> ComputerState:
        """Return what it says now; whatever cannot be read is None."""


class Lights(Protocol):
    """The LEDs on the four sides."""

    def set_ratio(self, ratio: LedRatio) -> float:
        """Set all four sides in one transaction; return the time (s) at which the chip acknowledged it."""

    def check_outputs(self) -> None:
        """Raise `OpenLedError` or `HotLedDriverError` when the chip can tell that current does not flow; end dark."""

    def check_line(self) -> bool:
        """Return whether the chip has shown that it obeys its enable line; raise `LightLineError` when it does not."""

    def go_on(self) -> None:
        """Say that whoever has the light on goes on; raise `LightCutError` when an enable line took it away."""

    def close(self) -> None:
        """Switch all sides off and release the bus."""


class Camera(Protocol):
    """The near-infrared camera below the waveguide."""

    def capture(self, *, begun_after_s: float, timeout_s: float) -> CameraFrame:
        """Return the next frame whose exposure began at or after a time; raise `CameraError` when none comes."""

    def rest(self) -> None:
        """Stop the stream until the next frame is asked for, which then comes later; raise `CameraError`."""

    def close(self) -> None:
        """Stop the stream."""


class LoadCell(Protocol):
    """The load cell behind the probe.

    `pause_s`: so long (s) it may let readings gather before it looks at them; each keeps the time that it was taken at.
    """

    pause_s: float

    def read(self, *, timeout_s: float) -> CellSample:
        """Return the next sample; raise `LoadCellError` when none comes in time."""

    def close(self) -> None:
        """Release the serial line."""
