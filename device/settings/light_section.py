"""The settings of the LED driver: which chip it is, at which address, and when the light is right.

A TLC59116 and a PCA9685 have other addresses, and only the latter's exposure must be whole periods of its brightness.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from device.hardware.pwm_clock import INTERNAL_HZ, PwmClock
from device.measurement.quantities import Bound
from device.settings.setting import Conflict, Section, conflict, setting

LightChip = Literal["tlc59116", "pca9685"]
RATIO = Bound(0.01, 0.9, "")


@dataclass(frozen=True)
class ChipAddresses:
    """I2C addresses that a chip's pins can give it, those that all of its kind share, and that of the common board."""

    first: int
    last: int
    shared: tuple[int, ...]
    default: int


CHIP_ADDRESSES: dict[LightChip, ChipAddresses] = {
    "tlc59116": ChipAddresses(0x60, 0x6F, (0x68, 0x6B), 0x60),
    "pca9685": ChipAddresses(0x40, 0x77, (0x70,), 0x40),
}
"""All call and software reset are shared (TLC59116 datasheet SLDS157E, 10.1; PCA9685 rev. 4, 7.1)."""


@dataclass(frozen=True)
class LightSection(Section):
    """The LED driver: chip, I2C bus and address, the brightness of the four sides while measuring, when light is right.

    Lists have one number a side: +x, +y, -x, -y.
    """

    prefix = "light."

    chip: LightChip = setting(
        "tlc59116",
        "LED driver on the board: a pca9685 needs an exposure of whole PWM periods.",
        choices=tuple(CHIP_ADDRESSES),
    )
    bus: int = setting(1, "I2C bus of the LED driver.", Bound(0, 255, ""))
    address: int | None = setting(
        None,
        "I2C address of the LED driver; 0x60 of a tlc59116 and 0x40 of a pca9685 unless given.",
        Bound(0x08, 0x77, ""),
        base=16,
    )
    pwm_hz: float = setting(1526.0, "Frequency of the brightness of a pca9685.", Bound(24.0, 1526.0, "Hz"))
    oscillator_hz: float = setting(INTERNAL_HZ, "Oscillator of a pca9685, as measured.", Bound(20e6, 30e6, "Hz"))
    ratio: tuple[float, ...] = setting(
        (0.6, 0.6, 0.6, 0.6),
        "Brightness of each side while measuring, of the first press if it is held at light.target_counts.",
        Bound(0.0, 1.0, "", low_included=False),
        count=4,
    )
    target_counts: float | None = setting(
        None,
        "Mean counts above dark at the target force that the light is held at from press to press; "
        "unless given the brightness stays.",
        Bound(1.0, 150.0, "counts"),
    )
    max_dark_counts: float = setting(
        12.0,
        "Mean of a frame without light, black level included, above which something shines.",
        Bound(0.0, 100.0, "counts"),
    )
    min_side_ratio: float = setting(
        0.3, "A side that alone gives less than this part of the brightest one's light is dark.", RATIO
    )
    max_dimming_ratio: float = setting(
        0.07, "Loss of a side's light, against commissioning or the first presses, that is warned of.", RATIO
    )
    commissioned_counts: tuple[float, ...] | None = setting(
        None,
        "Mean counts above dark at the target force of each side alone at full brightness.",
        Bound(1.0, 255.0, "counts"),
        count=4,
    )
    min_contrast_ratio: float = setting(
        0.3, "How much of a press's light must have come with the force; gel and sweat leave less.", RATIO
    )
    max_on_s: float = setting(
        300.0,
        "Time with light in one press, both of its parts together, after which the light goes off.",
        Bound(1.0, 3600.0, "s"),
    )

    @property
    def chip_address(self) -> int:
        """The chip's I2C address: as given, or with its address pins as they come."""
        return CHIP_ADDRESSES[self.chip].default if self.address is None else self.address

    @property
    def pwm_clock(self) -> PwmClock:
        """The period of a PCA9685."""
        return PwmClock.nearest(self.pwm_hz, self.oscillator_hz)

    def conflicts(self) -> Iterator[Conflict]:
        """Yield an address that the chip cannot have, or that is not its own."""
        taken = CHIP_ADDRESSES[self.chip]
        bound = Bound(taken.first, taken.last, f"of a {self.chip}")
        yield from conflict("light.address", self.chip_address, bound, "light.chip")
        if self.chip_address in taken.shared:
            other = f"not one that every {self.chip} answers at"
            yield Conflict("light.address", f"{self.chip_address:#04x}", other, ("light.chip",))

    def exposure_conflicts(self, exposure_us: float, frame_us: float) -> Iterator[Conflict]:
        """Yield an exposure of the chip's flashes that would differ from frame to frame."""
        if self.chip != "pca9685" or self.pwm_clock.is_whole(exposure_us):
            return
        period_us = self.pwm_clock.period_us
        nearest_us = self.pwm_clock.nearest_whole_us(exposure_us, frame_us)
        if nearest_us:
            bound = f"a whole number of the pca9685's periods of {period_us:.2f} us"
            others = "light.chip", "light.pwm_hz", "light.oscillator_hz"
            yield Conflict("camera.exposure_us", exposure_us, bound, others, f"set the nearest one, {nearest_us}")
        else:
            bound = f"one whose period, {period_us:.0f} us, fits into a frame of {frame_us:.0f} us"
            action = "raise it, or lower camera.frame_rate_hz"
            yield Conflict("light.pwm_hz", self.pwm_hz, bound, ("light.chip", "camera.frame_rate_hz"), action)
