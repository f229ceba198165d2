"""What camera and light are set to, as their chips have it: a mode of the sensor, an LED driver's wiring and period.

Numbers only, without NumPy and pydantic: the settings are compared by them, and the drivers in device/hardware set
them, also where the settings cannot be read as a whole (device/settings/plain_light.py). Sources:
libcamera formats R8, R10, R12, R16; picamera2 0.3.38 (`helpers.make_array`); NXP PCA9685 datasheet rev. 4, section
7.3.5 "PWM frequency PRE_SCALE".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from device.measurement.quantities import Bound

RawFormat = Literal["R8", "R10", "R12", "R16"]
RAW_BITS: dict[RawFormat, int] = {"R8": 8, "R10": 10, "R12": 12, "R16": 16}
"""Unpacked monochrome formats by libcamera's names, and their bits."""

LightChip = Literal["tlc59116", "pca9685"]

STEPS = 4096
"""Steps of one period of the PCA9685, and so of its brightness (12 bits)."""
PRESCALES = (3, 255)
"""Smallest and largest PRE_SCALE; the chip itself takes less for 3."""
INTERNAL_HZ = 25e6
WHOLE_WITHIN_US = 0.5
"""An exposure is set in whole microseconds."""


@dataclass(frozen=True)
class RawMode:
    """A mode of the sensor and the frame that is made of it; sizes are (width, height) in pixels.

    `crop_px` is the part in the middle of the sensor that a frame shows, to half a pixel. It is no larger than the
    sensor and no smaller than the frame (device/config.py refuses both).
    """

    sensor_px: tuple[int, int]
    crop_px: tuple[int, int]
    frame_px: tuple[int, int]
    raw_format: RawFormat = "R8"

    @classmethod
    def whole(cls, width_px: int, height_px: int, raw_format: RawFormat = "R8") -> RawMode:
        """Return the mode whose every pixel is one of the frame."""
        size = (width_px, height_px)
        return cls(size, size, size, raw_format)

    @property
    def bytes_per_px(self) -> int:
        """Bytes of one pixel in a row."""
        return 1 if self.raw_format == "R8" else 2

    @property
    def crop_from_px(self) -> tuple[int, int]:
        """First column and row of the sensor that a frame shows."""
        (sensor_x, sensor_y), (width, height) = self.sensor_px, self.crop_px
        return (sensor_x - width) // 2, (sensor_y - height) // 2


@dataclass(frozen=True)
class PwmClock:
    """A prescaler (3..255) of an oscillator: one period is 4096 (prescale + 1) of its cycles.

    An LED that is dimmed by switching shows each frame a different number of flashes, unless the exposure is a whole
    number of periods: then every frame sees the same light wherever it begins. Holds as well as the oscillator's
    frequency is known.
    """

    prescale: int = PRESCALES[0]
    oscillator_hz: float = INTERNAL_HZ

    @classmethod
    def nearest(cls, pwm_hz: float, oscillator_hz: float = INTERNAL_HZ) -> PwmClock:
        """Return the clock whose frequency is nearest to `pwm_hz`, by the datasheet's equation (1)."""
        prescale = round(oscillator_hz / (STEPS * pwm_hz)) - 1
        return cls(min(max(prescale, PRESCALES[0]), PRESCALES[1]), oscillator_hz)

    @property
    def period_us(self) -> float:
        """Duration of one PWM period."""
        return 1e6 * STEPS * (self.prescale + 1) / self.oscillator_hz

    def is_whole(self, exposure_us: float) -> bool:
        """Return whether an exposure is a whole number of periods, to the microsecond."""
        periods = round(exposure_us / self.period_us)
        return periods > 0 and abs(exposure_us - periods * self.period_us) <= WHOLE_WITHIN_US

    def nearest_whole_us(self, exposure_us: float, longest_us: float) -> int:
        """Return the nearest whole number of periods, at least one and at most `longest_us`; 0 when there is none."""
        periods = min(max(1, round(exposure_us / self.period_us)), int(longest_us / self.period_us))
        return round(periods * self.period_us)


@dataclass(frozen=True)
class ChipAddresses:
    """I2C addresses that a chip's pins can give it, those that all of its kind share, and that of the common board."""

    first: int
    last: int
    shared: tuple[int, ...]
    default: int

    def has(self, address: int) -> bool:
        """Return whether a chip can have an address for its own."""
        return self.first <= address <= self.last and address not in self.shared


CHIP_ADDRESSES: dict[LightChip, ChipAddresses] = {
    "tlc59116": ChipAddresses(0x60, 0x6F, (0x68, 0x6B), 0x60),
    "pca9685": ChipAddresses(0x40, 0x77, (0x70,), 0x40),
}
"""All call and software reset are shared (TLC59116 datasheet SLDS157E, 10.1; PCA9685 rev. 4, 7.1)."""

I2C_BUSES, I2C_ADDRESSES = Bound(0, 255, ""), Bound(0x08, 0x77, "")
GPIO_LINES = Bound(0, 511, "")
PWM_HZ, OSCILLATOR_HZ = Bound(24.0, 1526.0, "Hz"), Bound(20e6, 30e6, "Hz")


@dataclass(frozen=True)
class LightWiring:
    """Which chip drives the LEDs, at which address of which bus, and the GPIO line that enables its outputs, if any."""

    chip: LightChip = "tlc59116"
    bus: int = 1
    address: int | None = None
    enable_chip: str = "/dev/gpiochip0"
    enable_line: int | None = None
    pwm_hz: float = PWM_HZ.high
    oscillator_hz: float = INTERNAL_HZ

    @property
    def chip_address(self) -> int:
        """The chip's I2C address: as given, or with its address pins as they come."""
        return CHIP_ADDRESSES[self.chip].default if self.address is None else self.address

    @property
    def is_enabled_low(self) -> bool:
        """Whether a low level lets the chip shine: OE of a PCA9685 does, RESET of a TLC59116 takes its light away."""
        return self.chip == "pca9685"

    @property
    def pwm_clock(self) -> PwmClock:
        """The period of a PCA9685."""
        return PwmClock.nearest(self.pwm_hz, self.oscillator_hz)
