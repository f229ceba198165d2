"""What the simulated light does, in the numbers beside which docs/optics.md sets the paper's account of its image.

Lee & Won, IEEE JBHI 17(2), 2013: light injected from the sides is trapped by total internal reflection; where contact
deforms the elastic waveguide the light scatters, and the camera below sees it; pixel values follow the deformation.
"""

from __future__ import annotations

from typing import Any

from host_tools.verification.light import construction as construction
from host_tools.verification.light import contact as contact
from host_tools.verification.light import press as press
from host_tools.verification.light.dimple import dark_name
from host_tools.verification.light.scenes import DEPTHS_MM, slope_deg, traced
from host_tools.verification.light.trapping import contrast


def facts(rays: int) -> dict[str, Any]:
    """Return ratios, changes (1 is the whole) and angles of the chapters' scenes, by the names the template uses."""
    dark = [traced(dark_name(depth), rays) for depth in DEPTHS_MM]
    touched = [contact.brightening(f"dimple {d:g}, contact 1", "flat, contact 1", rays) for d in DEPTHS_MM]
    whole, bent, pressed, wet = (press.signal(name, rays) for name in press.CASES)
    names = (construction.DEFAULT, "LEDs cast into the block", "haze 0.001 / mm")
    window, cast, haze = (construction.measure(name, rays).contrast for name in names)
    return {
        "leak_ratio": traced("flat, dark", rays).ledger["through_face"],
        "contact_over_dark": contrast(rays),
        "slope_deg": slope_deg(DEPTHS_MM[-1]),
        "caught_ratio": max(image.specular_into_aperture for image in dark),
        "bottom_ratio": max(image.bottom_loss for image in dark),
        "whole_change": whole,
        "bent_change": bent,
        "pressed_change": pressed,
        "wet_change": wet,
        "dimples_mm": list(DEPTHS_MM),
        "dimples_brightness": touched,
        "gain_of_doubling": contact.gain_of_doubling(rays),
        "contrast_window": window,
        "contrast_cast": cast,
        "contrast_haze": haze,
    }
