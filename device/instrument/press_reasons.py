"""Why a press is rejected, in one sentence for the operator: what was seen, its bound, and what to do."""

from __future__ import annotations

from math import hypot


def too_hard(force_n: float, overload_n: float) -> str:
    """Return why a force is too much."""
    return f"The force rose to {force_n:.2f} N, above {overload_n:.2f} N: lift and press more gently."


def off_centre(spot_mm: tuple[float, float], max_offset_mm: float) -> str:
    """Return how far off the middle a lump is, and where the probe has to go: +x is right, +y is down in the image."""
    x_mm, y_mm = spot_mm
    towards = [
        f"{'+' if part > 0 else '-'}{axis}"
        for axis, part in (("x", x_mm), ("y", y_mm))
        if abs(part) >= max(abs(x_mm), abs(y_mm)) / 2
    ]
    return (
        f"The lump lies {hypot(x_mm, y_mm):.1f} mm off the middle, above {max_offset_mm:g} mm: "
        f"move the probe towards {' and '.join(towards)}."
    )
