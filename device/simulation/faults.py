"""What goes wrong in a scenario, and when: each emulated part asks here what is wrong with it at a time.

Every fault acts at the lowest seam there is: on the light that an output gives (not on its register), on the answer
of the bus, on the bytes of the serial line, on the rows of a frame, on the disk. Nothing above the chips is told.
Times are on the monotonic clock, counted from the start of the simulation or from a press.
"""

from __future__ import annotations

import errno
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime

from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.recording.led_sides import SIDES, LedRatio

PARAMETERS: dict[str, tuple[str, ...]] = {
    "camera_stall": (),
    "camera_late": (),
    "camera_torn": (),
    "camera_stale": (),
    "camera_hung": (),
    "camera_crashed": (),
    "i2c_nack": (),
    "i2c_stuck": (),
    "i2c_frozen": (),
    "enable_busy": (),
    "enable_unwired": (),
    "led_dead": ("side",),
    "led_stuck_on": ("side",),
    "led_dimmed": ("side", "ratio"),
    "led_open": ("side",),
    "led_driver_hot": (),
    "led_swapped": ("side", "other_side"),
    "ambient_light": ("ratio",),
    "wet_face": ("ratio",),
    "dirty_face": ("ratio",),
    "cell_silent": (),
    "cell_garbage": (),
    "cell_saturated": (),
    "cell_overloaded": (),
    "cell_disconnected": (),
    "cell_unplugged": (),
    "cell_frozen": (),
    "inference_frozen": (),
    "clock_jump": ("step_s",),
    "clock_set": ("date",),
    "clock_not_set": (),
    "disk_low": (),
    "disk_full": (),
    "disk_read_only": (),
    "disk_frozen": (),
    "bundle_tampered": (),
    "undervoltage": (),
    "computer_hot": (),
}
"""Every kind of fault, and what it takes besides its times."""

REQUIRED = {
    "led_dead": ("side",),
    "led_stuck_on": ("side",),
    "led_open": ("side",),
    "led_swapped": ("side", "other_side"),
    "clock_jump": ("step_s",),
    "clock_set": ("date",),
}
DEFAULT_RATIO = {"led_dimmed": 0.9, "ambient_light": 0.05, "wet_face": 1.0, "dirty_face": 0.03}
I2C_ERRNO = {"i2c_nack": 121, "i2c_stuck": errno.ETIMEDOUT}
"""What Linux answers: EREMOTEIO (121; macOS does not name it) for no acknowledgement, ETIMEDOUT for a line held low."""
ACTION = "describe one fault"
FROZEN_POLL_S = 0.02


@dataclass(frozen=True)
class ScriptedFault:
    """One fault: its kind, from when until when, and what it takes.

    `from_s` and `until_s` count from the start of the simulation, or with `from_press` = n from the n-th press that
    was requested. `side`: of one LED, all four without; `other_side`: whose plug it has (led_swapped). `ratio`: light
    that is left (led_dimmed), added light in units of full light (ambient_light, and dirty_face with all LEDs full),
    part of the face that is wet (wet_face). `step_s`: by how much the wall clock is off (clock_jump); `date`: what it
    shows at first (clock_set).
    """

    kind: str
    from_s: float = 0.0
    until_s: float = math.inf
    from_press: int = 0
    side: str | None = None
    other_side: str | None = None
    ratio: float | None = None
    step_s: float | None = None
    date: datetime | None = None

    def __post_init__(self) -> None:
        if self.kind not in PARAMETERS:
            raise InvalidQuantity("faults.kind", repr(self.kind), f"one of {', '.join(PARAMETERS)}", ACTION)
        require("faults.from_s", self.from_s, Bound(0.0, 1e6, "s"), ACTION)
        if not self.until_s > self.from_s:
            raise InvalidQuantity("faults.until_s", self.until_s, f"above from_s, {self.from_s:g} s", ACTION)
        require("faults.from_press", self.from_press, Bound(0, 1000, "(0: the start)"), ACTION)
        for name in ("side", "other_side", "ratio", "step_s", "date"):
            self._require_parameter(name)
        for name in ("side", "other_side"):
            if getattr(self, name) not in (None, *SIDES):
                raise InvalidQuantity(f"faults.{name}", repr(getattr(self, name)), f"one of {', '.join(SIDES)}", ACTION)
        if self.ratio is not None:
            require("faults.ratio", self.ratio, Bound(0.0, 1.0, ""), ACTION)
        if self.step_s is not None:
            require("faults.step_s", self.step_s, Bound(-1e10, 1e10, "s"), ACTION)
        if self.date is not None and self.date.tzinfo is None:
            raise InvalidQuantity("faults.date", self.date, "a time with its zone, as 2027-01-31T12:00:00Z", ACTION)

    def _require_parameter(self, name: str) -> None:
        is_given = getattr(self, name) is not None
        if is_given and name not in PARAMETERS[self.kind]:
            raise InvalidQuantity(f"faults.{name}", getattr(self, name), f"left out of {self.kind}", "remove it")
        if not is_given and name in REQUIRED.get(self.kind, ()):
            raise InvalidQuantity(f"faults.{name}", "missing", f"given for {self.kind}", "add it")

    @property
    def strength(self) -> float:
        """Return `ratio`, or what this kind takes without one."""
        return DEFAULT_RATIO[self.kind] if self.ratio is None else self.ratio


class FaultTimeline:
    """The faults of a scenario on the monotonic clock. May be asked from any thread."""

    def __init__(
        self,
        faults: Sequence[ScriptedFault] = (),
        *,
        clock: Callable[[], float] = time.monotonic,
        wall_clock: Callable[[], float] = time.time,
    ) -> None:
        self._faults, self._clock, self._wall_clock = tuple(faults), clock, wall_clock
        self._origins_s = [clock()]

    def begin_press(self) -> None:
        """Note that a press is requested now: the faults of that press count from here."""
        self._origins_s.append(self._clock())

    def is_active(self, kind: str, t_s: float | None = None) -> bool:
        """Return whether a fault of that kind is there at a time (s, monotonic), now unless given."""
        return next(self._active(kind, self._clock() if t_s is None else t_s), None) is not None

    def hold_up(self, kind: str) -> None:
        """Return when there is no fault of that kind: stands for a call that does not return while there is one."""
        while self.is_active(kind):
            time.sleep(FROZEN_POLL_S)

    def is_open(self, side: str) -> bool:
        """Return whether the circuit of a side's LED is open now."""
        return any(fault.side == side for fault in self._active("led_open", self._clock()))

    def led_output(self, ratio: LedRatio, t_s: float) -> LedRatio:
        """Return the light of the four sides when the chip's outputs ask for `ratio`: 0..1 of full light."""
        light = list(ratio)
        for fault in self._active("led_swapped", t_s):
            one, other = SIDES.index(str(fault.side)), SIDES.index(str(fault.other_side))
            light[one], light[other] = light[other], light[one]
        for kind, act in LIGHT_FAULTS.items():
            for fault in self._active(kind, t_s):
                for number in range(len(SIDES)):
                    if fault.side in (None, SIDES[number]):
                        light[number] = act(light[number], fault)
        return light[0], light[1], light[2], light[3]

    def ambient_ratio(self, t_s: float) -> float:
        """Return the foreign light on every pixel, in units of full light, at a time."""
        return sum(fault.strength for fault in self._active("ambient_light", t_s))

    def stray_ratio(self, led_ratio: LedRatio, t_s: float) -> float:
        """Return the light on every pixel, in units of full light, that dirt on the face lets out of the waveguide."""
        return sum(fault.strength for fault in self._active("dirty_face", t_s)) * sum(led_ratio) / len(led_ratio)

    def wet_ratio(self, t_s: float) -> float:
        """Return which part of the face is wet (0..1) at a time: there the image no longer depends on the press."""
        return max((fault.strength for fault in self._active("wet_face", t_s)), default=0.0)

    def i2c_errno(self) -> int | None:
        """Return the error number that the bus answers with now, or None when it works."""
        return next((number for kind, number in I2C_ERRNO.items() if self.is_active(kind)), None)

    def wall_time_s(self) -> float:
        """Return the seconds since 1970 that the board's clock shows now: wrong while it is set wrong."""
        now_s = self._clock()
        shown_s = self._wall_clock()
        for fault in self._active("clock_set", now_s):
            begun_s = self._origins_s[fault.from_press] + fault.from_s
            shown_s = fault.date.timestamp() + now_s - begun_s if fault.date else shown_s
        return shown_s + sum(fault.step_s or 0.0 for fault in self._active("clock_jump", now_s))

    def _active(self, kind: str, t_s: float) -> Iterator[ScriptedFault]:
        for fault in self._faults:
            if fault.kind == kind and fault.from_press < len(self._origins_s):
                origin_s = self._origins_s[fault.from_press]
                if fault.from_s <= t_s - origin_s < fault.until_s:
                    yield fault


LIGHT_FAULTS: dict[str, Callable[[float, ScriptedFault], float]] = {
    "led_dimmed": lambda light, fault: light * fault.strength,
    "led_dead": lambda light, fault: 0.0,
    "led_stuck_on": lambda light, fault: 1.0,
    "led_open": lambda light, fault: 0.0,
    "led_driver_hot": lambda light, fault: 0.0,
}
"""What each fault of an LED makes of its output's light."""

NO_FAULTS = FaultTimeline()
"""For parts with which nothing is wrong."""
