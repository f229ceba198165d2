"""The period of a PCA9685's brightness, and the exposures that see a whole number of them.

An LED that is dimmed by switching shows each frame a different number of flashes, unless the exposure is a whole number
of periods: then every frame sees the same light wherever it begins. Holds as well as the oscillator's frequency is
known. Source: NXP PCA9685 datasheet rev. 4, section 7.3.5 "PWM frequency PRE_SCALE".
"""

from __future__ import annotations

from dataclasses import dataclass

STEPS = 4096
"""Steps of one period, and so of the brightness (12 bits)."""
PRESCALES = (3, 255)
"""Smallest and largest PRE_SCALE; the chip itself takes less for 3."""
INTERNAL_HZ = 25e6
WHOLE_WITHIN_US = 0.5
"""An exposure is set in whole microseconds."""


@dataclass(frozen=True)
class PwmClock:
    """A prescaler (3..255) of an oscillator: one period is 4096 (prescale + 1) of its cycles."""

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
