"""The paper's account of its image, sentence by sentence, beside what the simulated light does.

Lee & Won, IEEE JBHI 17(2), 2013: light injected from the sides is trapped by total internal reflection; where contact
deforms the elastic waveguide the light scatters, and the camera below sees it; pixel values follow the deformation.
"""

from __future__ import annotations

from dataclasses import dataclass

from host_tools.verification.light import construction as construction
from host_tools.verification.light import contact as contact
from host_tools.verification.light import press as press
from host_tools.verification.light.dimple import dark_name
from host_tools.verification.light.scenes import DEPTHS_MM, slope_deg, traced
from host_tools.verification.light.trapping import contrast


@dataclass(frozen=True)
class Finding:
    """A statement, what was measured, and the verdict that holds as long as `supported`."""

    statement: str
    measured: str
    verdict: str
    supported: bool

    def row(self) -> str:
        """Return the finding as a row of a markdown table."""
        verdict = self.verdict if self.supported else "**open**: this run does not support it"
        return f"| {self.statement} | {self.measured} | {verdict} |"


def findings(rays: int) -> tuple[Finding, ...]:
    """Return the paper's statements and two it does not make, with this run's numbers."""
    return (_trapped(rays), _bent(rays), _touched(rays), _deeper(rays), _linear(rays), _wet(rays), _leds(rays))


def _trapped(rays: int) -> Finding:
    leak, ratio = traced("flat, dark", rays).ledger["through_face"], contrast(rays)
    measured = (
        f"{100 * leak:.1f} % leaves an untouched face; the centre is {ratio:.0f} times as bright in complete contact"
    )
    return Finding("Untouched, light is trapped by total internal reflection", measured, "confirmed", ratio >= 100)


def _bent(rays: int) -> Finding:
    images = [traced(dark_name(depth), rays) for depth in DEPTHS_MM]
    caught, bottom = max(i.specular_into_aperture for i in images), max(i.bottom_loss for i in images)
    slope, share = slope_deg(DEPTHS_MM[-1]), f"{caught:.1e} of it" if caught else "none of it"
    seen = f"the lens catches {share}"
    measured = f"up to {slope:.0f} degrees of slope {seen}; {100 * bottom:.0f} % leaves by the bottom unseen"
    return Finding(
        "Deformation makes the light leave towards the camera",
        measured,
        "corrected: it leaves at grazing angles; bending alone is invisible",
        caught == 0,
    )


def _touched(rays: int) -> Finding:
    bent, pressed = (press.signal(name, rays) for name in list(press.CASES)[1:3])
    alone = f"an inclusion's pressure alone changes the centre by {100 * pressed:+.0f} %"
    return Finding(
        "Contact with tissue makes it scatter",
        f"{alone}, its deformation alone by {100 * bent:+.1f} %",
        "confirmed, and it is the whole of it: the image shows pressure",
        abs(bent) < 0.2 * pressed,
    )


def _deeper(rays: int) -> Finding:
    ratios = [contact.brightening(f"dimple {d:g}, contact 1", "flat, contact 1", rays) for d in DEPTHS_MM]
    shown = ", ".join(f"{ratio:.2f}" for ratio in ratios)
    depths = ", ".join(f"{d:g}" for d in DEPTHS_MM)
    return Finding(
        "Deeper is brighter",
        f"in complete contact, dimples of {depths} mm are {shown} times as bright as the flat face",
        "corrected: at equal contact deeper is darker",
        all(ratio < 1.02 for ratio in ratios) and ratios[-1] < ratios[0],
    )


def _linear(rays: int) -> Finding:
    gain = contact.gain_of_doubling(rays)
    return Finding(
        "The sum of the pixels is linear in the force",
        f"twice the pressure gives {gain:.2f} times the light",
        "corrected: it saturates (by the assumed law of contact)",
        gain < 1.8,
    )


def _wet(rays: int) -> Finding:
    inclusion, _, _, wet = (press.signal(name, rays) for name in press.CASES)
    return Finding(
        "(not in the paper) Gel and sweat",
        f"the inclusion's {100 * inclusion:+.0f} % become {100 * wet:+.1f} % on skin that is wet all over",
        "a wet face shows no inclusion: wipe it dry",
        abs(wet) < 0.2 * inclusion,
    )


def _leds(rays: int) -> Finding:
    names = (construction.DEFAULT, "LEDs cast into the block", "haze 0.001 / mm")
    designed, cast, hazy = (construction.measure(name, rays).contrast for name in names)
    return Finding(
        "(not in the paper) Where the LEDs must be",
        f"contrast {designed:.0f} behind a window, {cast:.1f} cast into the block; {hazy:.0f} with haze of 0.001 / mm",
        "outside the block, behind a flat window; the block clear, its walls black",
        cast < designed / 5,
    )
