"""What a commissioning found on one page for who keeps the probe: verdict first, then pictures, limits and advice.

The page is one file of HTML with its pictures in it. It runs nothing and loads nothing, so it reads the same in ten
years, and prints. The model card has its numbers for programs; it adds none of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from device.measurement.parameters import RANGES
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.commissioned.row_derivatives import NAMES
from device.measurement.ramp_modes.radial_profile import CONTRAST, RESPONSE
from host_tools.commissioning import page_pictures as pictures
from host_tools.commissioning.believed_presses import BelievedAnswers
from host_tools.commissioning.commission import WORST_PHANTOM, CommissionedProbe
from host_tools.commissioning.joint_fit import FLOOR, PROBE, ProbeFit
from host_tools.commissioning.probe_prior import LABELS
from host_tools.commissioning.report import SILICONE

PAGE_FILE = "commissioning.html"
TEMPLATE = "commissioning.html.jinja"
NOTHING_MORE = "The set has the surfaces and tissues that are asked for; no more phantoms are advised."


def commissioning_page(
    done: CommissionedProbe,
    card: Mapping[str, Any],
    advice: Sequence[str] = (),
    *,
    lacks: Sequence[str] = (),
    is_simulated: bool = False,
) -> str:
    """Return the page of a commissioning as HTML; `card` is the bundle's, `advice` what would tell more.

    `lacks` is what keeps the recordings from a certificate, without which the probe answers nothing.
    Every text of a file, names above all, is escaped.
    """
    inclusions = {one.name for one in done.phantoms}
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["day"] = lambda moment: f"{datetime.fromisoformat(moment):%-d %B %Y}"
    return environment.get_template(TEMPLATE).render(
        card=card,
        serial=card["serials"][0],
        record=card["commissioned"],
        lacks=list(lacks),
        is_simulated=is_simulated,
        gates=[gate.as_record() for gate in done.gates],
        ranges={name: RANGES[name] for name in (*UNKNOWNS, "tissue_modulus_kpa", "slab_thickness_mm")},
        inclusions=len(inclusions),
        blocks=len(set(done.names) - inclusions),
        covered=_covered(done),
        ramps=list(_ramps(done)),
        directions=list(_directions(done.fit)),
        floor=FLOOR,
        levels=done.fit.levels,
        believed=done.fit.believed,
        critical=done.critical["standard"],
        misfit_of_scans=done.critical["precise"].misfit_ratio,
        phantoms=done.phantoms,
        unknown_labels=list(pictures.UNKNOWN_LABELS.values()),
        has_quick=done.held is not None,
        modes=[_mode(name, answers) for name, answers in _believed(done)],
        silicone=SILICONE,
        advice=list(advice) or [NOTHING_MORE],
        pictures=dict(_pictures(done)),
    )


def _pictures(done: CommissionedProbe) -> Iterator[tuple[str, str]]:
    yield "residuals", pictures.residual_maps(done.names, done.fit.left_ratio)
    if done.fit.believed.discrepancy_ratio:
        yield "lacking", pictures.lacking_maps(done.fit.discrepancy)
    yield "posterior", pictures.probe_posterior(done.fit)
    yield "left_out", pictures.left_out_intervals(done.phantoms)
    yield "misfits", pictures.left_out_misfits(done.phantoms, done.critical["standard"].misfit_ratio, WORST_PHANTOM)
    coverage = [(name.partition(",")[0], answers.answered) for name, answers in _believed(done)]
    yield "coverage", pictures.believed_coverage(coverage)


def _believed(done: CommissionedProbe) -> list[tuple[str, BelievedAnswers]]:
    held = [("quick, one hold", done.held)] if done.held else []
    return [*held, ("standard, one press", done.presses), ("precise, a scan", done.scans)]


def _covered(done: CommissionedProbe) -> list[dict[str, Any]]:
    """Return of each unknown in how many phantoms left out it is determined, and in how many of these covered."""
    known = np.array([one.is_determined for one in done.phantoms])
    held = np.array([one.is_covered for one in done.phantoms]) & known
    columns = zip(pictures.UNKNOWN_LABELS.values(), held.sum(axis=0), known.sum(axis=0), strict=True)
    return [{"unknown": label.partition(" (")[0], "held": int(a), "known": int(b)} for label, a, b in columns]


def _ramps(done: CommissionedProbe) -> Iterator[dict[str, Any]]:
    """Yield name, truth and misfit of each ramp, and what is left of it (rms, permille of the light)."""
    truths = {one.name: one.truth for one in done.phantoms}
    columns = zip(done.names, done.fit.offset_mm, done.fit.misfit_ratio, done.fit.left_ratio, strict=True)
    for name, offset_mm, misfit, left in columns:
        contrast, response = (1000 * float(np.sqrt(np.mean(left[part] ** 2))) for part in (CONTRAST, RESPONSE))
        yield {
            "name": name,
            "truth": truths.get(name),
            "offset_mm": None if np.isnan(offset_mm) else float(offset_mm),
            "misfit": misfit,
            "contrast": None if np.isnan(contrast) else contrast,
            "response": response,
        }


def _directions(fit: ProbeFit) -> Iterator[dict[str, Any]]:
    """Yield each direction of the probe with half of the 90 % interval of what is found, and of its tolerance."""
    half, prior = pictures.HALF_WIDTH_STD, fit.prior
    columns = zip(PROBE, fit.mean, np.sqrt(np.diag(fit.covariance)), np.abs(fit.tolerances_away), strict=True)
    for number, mean, std, away in columns:
        yield {
            "label": LABELS[NAMES[number]],
            "expected": prior.mean[number],
            "mean": mean,
            "half": half * std,
            "tolerance": half * prior.std[number],
            "away": away,
        }


def _mode(name: str, found: BelievedAnswers) -> dict[str, Any]:
    """Return what the table says of a mode; `both` is None where nothing has numbers."""
    answered, drawn = found.answered, len(found.is_answered)
    if not len(answered.truth):
        return {"name": name, "drawn": drawn, "numbers": 0.0, "both": None, "held": None}
    known, held = (np.asarray(one[:, :2].all(axis=1)) for one in (answered.is_known, answered.is_covered))
    return {
        "name": name,
        "drawn": drawn,
        "numbers": len(known) / drawn,
        "both": float(known.mean()),
        "held": float(held[known].mean()) if known.any() else None,
    }
