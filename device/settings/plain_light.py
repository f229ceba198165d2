"""Settings files to the places where the LED chip may be, without pydantic: for what darkens the LEDs.

To check all settings (device/settings/layers.py) takes longer than to darken. So only what tells where the chip is is
looked at. Files that are bad elsewhere, or have changed since the daemon started, do not say what it started with: so
the last good settings are asked, too. Where neither can be used every chip that there is may be the one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.config_chips import (
    CHIP_ADDRESSES,
    GPIO_LINES,
    I2C_ADDRESSES,
    I2C_BUSES,
    OSCILLATOR_HZ,
    PWM_HZ,
    LightWiring,
)
from device.files.plain_settings import DATA, LAST_GOOD, is_there, plain_table
from device.measurement.quantities import Bound

SECTION = "light"


def _whole(bound: Bound) -> Callable[[Any], bool]:
    return lambda value: type(value) is int and bound.holds(value)


def _number(bound: Bound) -> Callable[[Any], bool]:
    return lambda value: type(value) in (int, float) and bound.holds(value)


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


HOLDS: dict[str, Callable[[Any], bool]] = {
    "chip": lambda value: _is_text(value) and value in CHIP_ADDRESSES,
    "bus": _whole(I2C_BUSES),
    "address": _whole(I2C_ADDRESSES),
    "enable_chip": _is_text,
    "enable_line": _whole(GPIO_LINES),
    "pwm_hz": _number(PWM_HZ),
    "oscillator_hz": _number(OSCILLATOR_HZ),
}
"""What a value has to be, of each setting that tells where the chip is: as device/config.py has it."""


@dataclass(frozen=True)
class PlainLight:
    """The places where the chip may be, at least one, the likeliest first, and the daemon's data folder.

    With `is_said` the files themselves say the first place. Without it they are bad, and the settings as a whole have
    to be asked for what is wrong.
    """

    wirings: tuple[LightWiring, ...]
    is_said: bool
    data: Path


@dataclass(frozen=True)
class _Stated:
    """What files state of the chip's place and the data folder, where each value holds; `is_good`: all of it does."""

    light: Mapping[str, Any]
    data: Path
    is_good: bool

    @property
    def wiring(self) -> LightWiring | None:
        """Return the chip's place, unless something of it is bad."""
        wiring = LightWiring(**self.light)
        return wiring if self.is_good and CHIP_ADDRESSES[wiring.chip].has(wiring.chip_address) else None


def plain_light(files: Iterable[Path]) -> PlainLight:
    """Return where the chip may be by settings files, lowest first; nothing that is in them is an error."""
    stated = _stated(files)
    last = stated.data / LAST_GOOD
    places = (stated.wiring, _stated([last]).wiring if is_there(last) else None)
    wirings = dict.fromkeys(place for place in places if place)  # each once, in this order
    return PlainLight(tuple(wirings) or tuple(_all_chips(stated.light)), stated.wiring is not None, stated.data)


def _stated(files: Iterable[Path]) -> _Stated:
    light, data, is_good = dict[str, Any](), Path(DATA), True
    for path in files:
        try:
            table = plain_table(path)
        except (OSError, ValueError):
            is_good = False
            continue
        section = table.get(SECTION, {})
        entries = section if isinstance(section, dict) else {SECTION: section}
        held = {name: value for name, value in entries.items() if name in HOLDS and HOLDS[name](value)}
        is_good = is_good and all(name in held for name in entries if name in {*HOLDS, SECTION})
        light |= held
        data = Path(table["data"]) if _is_text(table.get("data")) else data
    return _Stated(light, data, is_good)


def _all_chips(light: Mapping[str, Any]) -> Iterator[LightWiring]:
    """Yield each chip, at the address that is stated where it can have that, else at its own.

    A PCA9685 is the last: its line is let go high, which lets a TLC59116 be, dark as it is after its reset.
    """
    for chip, its in CHIP_ADDRESSES.items():
        address = light.get("address")
        if address is None or not its.has(address):
            address = None
        yield LightWiring(**{**light, "chip": chip, "address": address})
