"""A face that is bent and not touched: does bending alone make an image?

Mirror-like reflection at a slope s turns a ray by 2 s; light that came no steeper than 45 degrees must be turned by
almost 30 before the lens can catch it. Source: geometry; the slopes of Gaussian dimples are known.
"""

from __future__ import annotations

from host_tools.pages.benchmark import Benchmark, Chapter, Figure, Table, at_least, at_most
from host_tools.verification.light.pictures import draw_maps
from host_tools.verification.light.scenes import (
    DEPTHS_MM,
    STEEP_MM,
    STEEP_WIDTH_MM,
    brightest,
    centre,
    slope_deg,
    traced,
)

STEEP_BOUND, SATELLITE_BOUND_MM, LEAK_RATIO_BOUND = 1e-6, 1.5, 5.0


def dark_name(depth_mm: float) -> str:
    """Return the name of the scene with nothing behind the dimple."""
    return f"dimple {depth_mm:g}, dark"


def gap_name(depth_mm: float) -> str:
    """Return the name of the scene with skin across the air gap."""
    return f"dimple {depth_mm:g}, skin across air"


def benchmarks(rays: int) -> tuple[Benchmark, ...]:
    """Return what the lens catches of a bent face, and where the leak onto skin across the gap shines."""
    caught = "light straight into the aperture"
    seen = (
        at_most(
            f"dimple {depth:g} mm, slope {slope_deg(depth):.1f} degrees, nothing behind",
            caught,
            traced(dark_name(depth), rays).specular_into_aperture,
            0.0,
        )
        for depth in DEPTHS_MM
    )
    steep = traced("steep dimple, dark", rays).specular_into_aperture
    return (
        *seen,
        at_least(
            f"dimple {STEEP_MM:g} mm, slope {slope_deg(STEEP_MM, STEEP_WIDTH_MM):.1f} degrees",
            caught,
            steep,
            STEEP_BOUND,
        ),
        *(b for depth in DEPTHS_MM[1:] for b in _leak(depth, rays)),
    )


def _leak(depth_mm: float, rays: int) -> tuple[Benchmark, ...]:
    found = traced(gap_name(depth_mm), rays)
    most, at_mm = brightest(found)
    case = f"dimple {depth_mm:g} mm, skin across air"
    return (
        at_least(case, "brightest place: distance from the centre (mm)", at_mm, SATELLITE_BOUND_MM),
        at_least(case, "brightest place / centre", most / centre(found), LEAK_RATIO_BOUND),
    )


def _rows(rays: int) -> list[tuple[str, ...]]:
    steep = ("steep dimple, dark", "steep dimple, skin across air", slope_deg(STEEP_MM, STEEP_WIDTH_MM))
    rows: list[tuple[str, ...]] = []
    for name, across, slope in (*((dark_name(d), gap_name(d), slope_deg(d)) for d in DEPTHS_MM), steep):
        dark, leak = traced(name, rays), traced(across, rays)
        most, at_mm = brightest(leak)
        shares = (f"{dark.bottom_loss:.4f}", f"{dark.specular_into_aperture:.1e}")
        rows.append((name, f"{slope:.1f}", *shares, f"{centre(leak):.1e}", f"{most:.1e}", f"{at_mm:.1f}"))
    return rows


def chapter(rays: int) -> Chapter:
    """Return the chapter."""
    header = (
        "scene",
        "steepest slope (degrees)",
        "leaves by the bottom",
        "into the aperture",
        "centre, skin across air",
        "brightest there",
        "at (mm)",
    )
    names = {gap_name(depth): traced(gap_name(depth), rays) for depth in DEPTHS_MM}
    caption = "Simulated radiance of dimples 0.3, 0.8 and 1.5 mm deep with skin across the air gap"
    figure = Figure("optics_dimple.svg", caption, lambda canvas: draw_maps(canvas, names), size_in=(8.5, 3.2))
    return Chapter(
        "A dimple alone makes no image of itself",
        "Dimples turn light out of the block, but at grazing angles that the lens never sees.",
        "Geometry of reflection; the rest is this model compared with itself.",
        benchmarks(rays),
        (Table("Nothing behind the dimple, then skin across the air gap", header, tuple(_rows(rays))),),
        (figure,),
        facts={"slope_deg": slope_deg(DEPTHS_MM[-1]), "steep_deg": slope_deg(STEEP_MM, STEEP_WIDTH_MM)},
    )
