"""`python -m device focus`: hold the LEDs on, and print once a second how bright, saturated and sharp the image is.

For whoever builds a probe: the lens is turned, and exposure, gain and brightness are chosen, before there is a load
cell, a model or a certificate.
Exit codes: 0 ended by Ctrl-C, SIGTERM, --lines or the light's budget; 1 a part failed or did not open.
"""

from __future__ import annotations

import argparse
import math
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import closing
from itertools import islice

from device.assembly.opened_parts import StartFailed
from device.commands.record import ctrl_c
from device.config import Config
from device.errors import DeviceError, LightBudgetError
from device.instrument.acquisition.frame_quality import FrameQuality
from device.instrument.acquisition.light_check import FEWEST_COUNTS
from device.instrument.focusing import Focusing
from device.instrument.press.states import Guidance
from device.measurement.estimate import SATURATED_RATIO
from device.measurement.quantities import Bound, require
from device.measurement.recording.led_sides import SIDES, LedRatio
from device.measurement.recording.tactile_image import FLOOR_COUNTS
from device.settings.catalogue import SETTINGS

LIT = Bound(0.0, 1.0, "", low_included=False)
FULL_COUNTS = 255.0
"""Frames have 8 bits, whatever the sensor has."""
EXPOSURE = "camera.exposure_us"
EXAMPLES = """examples:
  python -m device focus                       all sides at light.ratio, until Ctrl-C
  python -m device focus --ratio 0.2           all sides at a fifth of full brightness
  python -m device focus --side=-x             one side alone; write = before a minus
  python -m device focus --simulate --lines 5  the virtual probe, five seconds
For the lens put the printed plate of a grid target in oil on the face and hold still: turn until the sharpness falls,
then back to the best. For the light hold the probe on the reference block with press.target_n, without oil.
A daemon that runs holds the hardware: stop it first. Each end is dark; after a SIGKILL `python -m device led-off` is.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.epilog = EXAMPLES
    parser.add_argument("--ratio", type=float, metavar="R", help="brightness, above 0 to 1; light.ratio unless given")
    parser.add_argument("--side", choices=SIDES, help="light this side alone")
    parser.add_argument("--lines", type=int, metavar="N", help="end after so many lines, one a second")
    # Also before the command: there they are for every command.
    parser.add_argument("--simulate", action="store_true", default=argparse.SUPPRESS, help="of the virtual probe")


def run_focus_command(options: argparse.Namespace, config: Config, opener: Callable[[], Focusing]) -> int:
    """Print the frames of the light and camera that `opener` opens, a line a second; return the exit code.

    Raises `InvalidQuantity` for a brightness or a number of lines that cannot be, before anything is opened.
    """
    ratio = _ratio(options, config)
    if options.lines is not None:
        require("lines", options.lines, Bound(1, math.inf, ""), "give how many lines are wanted, or leave it out")
    seen: list[FrameQuality] = []
    try:
        with ctrl_c() as stopped, closing(opener()) as focusing:
            focusing.board.on_guidance(_tell)
            with closing(_seconds(focusing, ratio, stopped)) as seconds:
                for quality in islice(seconds, options.lines):
                    seen.append(quality)
                    print(_line(quality, max(one.sharpness or 0.0 for one in seen)), flush=True)
    except DeviceError as error:
        print(f"{error.code} {error}", file=sys.stderr)
        return 1
    except StartFailed as end:
        print(end, file=sys.stderr)
        return 1
    if seen:
        print(advice(seen[-1], config, is_one_side=options.side is not None))
    return 0


def _ratio(options: argparse.Namespace, config: Config) -> LedRatio:
    """Return what the sides are lit with."""
    asked = config.light.ratio
    if options.ratio is not None:
        action = "give the brightness as a part of full scale"
        plus_x = plus_y = minus_x = minus_y = require("ratio", options.ratio, LIT, action)
        asked = plus_x, plus_y, minus_x, minus_y
    if options.side is None:
        return asked
    plus_x, plus_y, minus_x, minus_y = (
        ratio if side == options.side else 0.0 for side, ratio in zip(SIDES, asked, strict=True)
    )
    return plus_x, plus_y, minus_x, minus_y


def _seconds(focusing: Focusing, ratio: LedRatio, stopped: threading.Event) -> Generator[FrameQuality, None, None]:
    """Yield what is seen each second; a budget that is used up is an end like any other, and told."""
    try:
        yield from focusing.seconds(ratio, stopped)
    except LightBudgetError as end:
        print(f"{end.code} {end.cause} Let the LEDs rest for {end.wait_s} s.", file=sys.stderr, flush=True)


def _tell(guidance: Guidance) -> None:
    if guidance is Guidance.HOLD_BLOCK:
        told = "The LEDs are on. For the light: the reference block. For the lens: a printed plate in oil. Ctrl-C ends."
        print(told, file=sys.stderr, flush=True)


def _line(seen: FrameQuality, best: float) -> str:
    sharpness = "sharpness none: no light"
    if seen.sharpness is not None:
        part = seen.sharpness / best if best else 1.0
        sharpness = f"sharpness {seen.sharpness:.3g}, {part:.0%} of the best, {best:.3g}"
    return (
        f"mean {seen.mean_counts:.1f} counts, brightest (99.9 %) {seen.brightest_counts:.0f} counts, "
        f"saturated {seen.saturated_ratio:.2%} of pixels, {sharpness}"
    )


def advice(seen: FrameQuality, config: Config, *, is_one_side: bool) -> str:
    """Return whether a press would take such an image, by the bounds that it has, and else which settings to change."""
    fewest = FEWEST_COUNTS if is_one_side else FLOOR_COUNTS
    saturated = f"{seen.saturated_ratio:.2%} of the pixels are saturated"
    if seen.saturated_ratio > SATURATED_RATIO:
        changes = ", then ".join((_limit("camera.gain", config, -1), "light.ratio", _limit(EXPOSURE, config, -1)))
        told = f"Too bright: {saturated}, above {SATURATED_RATIO:.1%}. Lower {changes}."
    elif seen.light_counts < fewest:
        changes = ", then ".join(("light.ratio", _limit(EXPOSURE, config, 1), _limit("camera.gain", config, 1)))
        told = f"Too dark: the mean is {seen.light_counts:.1f} counts above dark, below {fewest:g}. Raise {changes}."
    else:
        room = (FULL_COUNTS - seen.dark_counts) / max(seen.brightest_counts - seen.dark_counts, 1.0)
        told = (
            f"Bright enough: the mean is {seen.light_counts:.1f} counts above dark, at least {fewest:g}, and "
            f"{saturated}, at most {SATURATED_RATIO:.1%}. It saturates at {room:.1f} times the light: "
            "raise light.ratio, camera.exposure_us and camera.gain by less in all."
        )
    return " ".join(filter(None, (_dark_advice(seen, config.light.max_dark_counts), told)))


def _dark_advice(seen: FrameQuality, max_dark_counts: float) -> str:
    """Return what to do about frames without light that a press would refuse, empty when it would not."""
    if seen.dark_counts <= max_dark_counts:
        return ""
    return (
        f"Without light the mean is {seen.dark_counts:.1f} counts, above light.max_dark_counts, {max_dark_counts:g}: "
        "shade the probe, or set that by the camera's black level."
    )


def _limit(name: str, config: Config, direction: int) -> str:
    """Return a setting with its value and how far it goes, down or up."""
    known = SETTINGS[name]
    assert known.bound is not None  # each of the two is a number with a range
    high = min(known.bound.high, 1e6 / config.camera.frame_rate_hz) if name == EXPOSURE else known.bound.high
    end = f"at least {known.bound.low:g}" if direction < 0 else f"at most {math.floor(high)}"
    return f"{name} ({' '.join(filter(None, (f'{known.value(config):g}', known.unit)))}, {end})"
