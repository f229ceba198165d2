"""Which light a block can hold: critical angles by Snell's law, and the reflectances the ray tracer draws from.

Light that enters an upright side wall from air is refracted towards the wall's normal, so it meets the face no
steeper than 90 degrees less the block's own critical angle. Source: Hecht, Optics, 5th ed., sections 4.4-4.7.
"""

from __future__ import annotations

from collections.abc import Callable
from math import asin, atan, cos, degrees, nan, radians, sqrt

from host_tools.optics.fresnel import plate_transmission, reflectance, refracted_cosine
from host_tools.pages.benchmark import Benchmark, Chapter, Table, absolute

BLOCK_INDICES = (1.39, 1.40, 1.41, 1.42, 1.43)
"""Silicone rubbers in the near infrared; 1.41 is the default."""
TISSUE_INDICES = (1.35, 1.37, 1.38, 1.40, 1.42)
AIR, BLOCK, GLASS = 1.0, 1.41, 1.52
ANGLE_BOUND_DEG, SHARE_BOUND = 1e-6, 1e-12


def critical_angle_deg(passes: Callable[[float], bool]) -> float:
    """Return the incidence at which light stops passing, found by bisection; nan where it passes at every angle.

    `passes` takes the cosine of incidence.
    """
    low, high = 0.0, 90.0
    if passes(cos(radians(high - 1e-9))):
        return nan
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if passes(cos(radians(middle))) else (low, middle)
    return low


def critical_angle_of_interface_deg(n_from: float, n_to: float) -> float:
    """Return the critical angle of one interface as the tracer's own refraction has it; nan where all light passes."""
    return nan if n_to >= n_from else critical_angle_deg(lambda c: refracted_cosine(c, n_from, n_to) > 0)


def lowest_incidence_deg(n_block: float) -> float:
    """Return the steepest incidence on the face of light that entered a side wall from air at a grazing angle."""
    return 90.0 - degrees(asin(1 / n_block))


def benchmarks() -> tuple[Benchmark, ...]:
    """Return the tracer's refraction and reflectance against the formulas on paper."""
    tilt = radians(30.0)
    bent = refracted_cosine(cos(tilt), BLOCK, AIR)
    brewster = ((BLOCK**2 - AIR) / (BLOCK**2 + AIR)) ** 2 / 2
    through = critical_angle_deg(lambda cosine: plate_transmission(cosine, BLOCK, GLASS, AIR) > 0)
    return (
        *(_critical(n, AIR, "air") for n in BLOCK_INDICES),
        _critical(BLOCK, 1.38, "tissue 1.38"),
        absolute(
            "block to air through bonded glass 1.52",
            "critical angle (degrees)",
            through,
            degrees(asin(1 / BLOCK)),
            ANGLE_BOUND_DEG,
        ),
        absolute(
            "block of index sqrt 2",
            "lowest incidence less critical angle (degrees)",
            lowest_incidence_deg(sqrt(2)) - critical_angle_of_interface_deg(sqrt(2), AIR),
            0.0,
            ANGLE_BOUND_DEG,
        ),
        absolute("block to air, head-on", "reflectance", reflectance(1.0, BLOCK, AIR), (0.41 / 2.41) ** 2, SHARE_BOUND),
        absolute(
            "block to air, Brewster's angle",
            "reflectance",
            reflectance(cos(atan(AIR / BLOCK)), BLOCK, AIR),
            brewster,
            SHARE_BOUND,
        ),
        absolute(
            "block to air at 30 degrees, there less back",
            "reflectance",
            reflectance(cos(tilt), BLOCK, AIR) - reflectance(bent, AIR, BLOCK),
            0.0,
            SHARE_BOUND,
        ),
    )


def _critical(n_from: float, n_to: float, to: str) -> Benchmark:
    found, exact = critical_angle_of_interface_deg(n_from, n_to), degrees(asin(n_to / n_from))
    return absolute(f"block {n_from:.2f} to {to}", "critical angle (degrees)", found, exact, ANGLE_BOUND_DEG)


def _angle(value_deg: float) -> str:
    return "all passes" if value_deg != value_deg else f"{value_deg:.1f}"


def _table() -> Table:
    header = ("block", "air", "lowest incidence of wall light", "what leaks", *(f"skin {n:g}" for n in TISSUE_INDICES))
    rows = []
    for n in BLOCK_INDICES:
        to_air, lowest = critical_angle_of_interface_deg(n, AIR), lowest_incidence_deg(n)
        leak = f"{to_air - lowest:.2f} wide" if lowest < to_air else "nothing"
        wet = (_angle(critical_angle_of_interface_deg(n, tissue)) for tissue in TISSUE_INDICES)
        rows.append((f"{n:.2f}", f"{to_air:.1f}", f"{lowest:.1f}", leak, *wet))
    return Table("Critical angles by the block's index (degrees from the face's normal)", header, tuple(rows))


def chapter(_rays: int) -> Chapter:
    """Return the chapter; it traces no rays."""
    return Chapter(
        "Which light is trapped",
        "Light beyond the critical angle is reflected whole.",
        "Hecht, Optics, 5th edition, sections 4.4-4.7.",
        benchmarks(),
        (_table(),),
    )
