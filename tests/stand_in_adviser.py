"""Advice on a scan that a test states: half widths by the number of presses, and whether another one is worth it."""

from __future__ import annotations

from collections.abc import Callable

from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate, Quantity
from device.measurement.recording.recording import Recording
from device.measurement.scan_advice import ScanAdvice, half_widths

SIZE_MM, DEPTH_MM = 12.0, 6.0


def no_advice(recording: Recording) -> ScanAdvice:
    """Stand for the adviser of a probe that nobody scans with."""
    raise AssertionError("nobody scans here")


def advice(half_width_mm: float, next_offset_mm: float | None = 4.0) -> ScanAdvice:
    """Return that size and depth are known to so much; the next press is said to halve it. The modulus is unknown."""
    size, depth = (
        Quantity(value, value - half_width_mm, value + half_width_mm, 0.1, True) for value in (SIZE_MM, DEPTH_MM)
    )
    reason = "This press does not determine Young's modulus."
    estimate = Estimate(size, depth, UNKNOWN_QUANTITY, "ok", reason, "precise", "stand-in", "00", "c", True, {})
    now = half_widths(estimate)
    return ScanAdvice(estimate, now, next_offset_mm, {name: width / 2 for name, width in now.items()})


def narrowing(half_width_mm: float) -> Callable[[Recording], ScanAdvice]:
    """Return an adviser by whom half widths are so much after the first press, and a half, a third after the next."""
    return lambda recording: advice(half_width_mm / len(recording.ramps()))
