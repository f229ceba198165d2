"""A commissioned probe to its bundles: one of modes standard and precise, and one of mode quick.

The certificate stands beside the former, and all hold until the same moment.

Networks of ramps, polynomials and the camera's noise are the design's, to the byte. Serial, what is believed of the
probe, limits, what the answers are worth and all of mode quick are its own.
Source of the format: the model bundle of docs/contracts.md.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from device import __version__
from device.files.shipped import CERTIFICATES
from device.measurement.bundle import CARD_FILE, MODEL_FILE
from device.measurement.calibration import Calibration, written
from device.measurement.mode import FRAMES, Mode
from device.measurement.quantities import Bound, InvalidQuantity
from device.measurement.ramp_modes.commissioned.row_derivatives import NAMES
from device.measurement.ramp_modes.model import SURROGATE_FILE, surrogate_arrays
from device.measurement.ramp_modes.range_classifier import ENTRY, OWN_ENTRY, OWN_RANGE_FILE, RANGE_FILE
from host_tools.calibration.certified_probe import source_sha256
from host_tools.commissioning.believed_presses import BelievedAnswers, believed_dial
from host_tools.commissioning.commission import CommissionedProbe
from host_tools.commissioning.joint_fit import PROBE
from host_tools.commissioning.own_quick import OwnQuick
from host_tools.commissioning.page import PAGE_FILE, commissioning_page
from host_tools.paper_network.export import write_folder
from host_tools.press_models.export import export_quick, npz_content
from host_tools.press_models.mode_statistics import half_width_by_ramps, reachable_half_width, statistics

VALID_DAYS = Bound(1.0, 730.0, "days")
"""How long a commissioning may hold: silicone stiffens, LEDs fade."""
CERTIFICATE_FILE = CERTIFICATES["physical"]
KEYS_OF_DESIGN = "dial", "recorded", "simulated", "reachable_half_width", "half_width_by_ramps"
"""What a card says of the design's own probe, and of no other."""


def write_own_bundle(
    done: CommissionedProbe,
    design: Path,
    folder: Path,
    *,
    serial: str,
    made_at: datetime,
    expires_at: str,
    command: str,
    origin: dict[str, Any],
    certificate: Calibration | None = None,
    lacks: Sequence[str] = (),
    advice: Sequence[str] = (),
    is_simulated: bool = False,
) -> None:
    """Write the bundle of a probe to a new folder, from the design's in `design`; whole or not at all.

    It holds until `expires_at` (RFC 3339), as a certificate of the recordings does.
    `origin` names `phantoms` and `design`, the files and recordings by their hashes.
    Beside it stands `PAGE_FILE`, which also says what the recordings lack of a certificate (`lacks`), what more would
    buy, `advice`, and whether ramps were simulated. Raises `InvalidQuantity` for a folder that is there.
    """
    require_new(folder)
    files = {path.name: path.read_bytes() for path in design.iterdir()}
    card = json.loads(files[CARD_FILE])
    surrogate = npz_content(surrogate_arrays(done.answers))
    card |= {
        "name": folder.resolve().name,
        "serials": [serial],
        "training_command": command,
        "software_version": __version__,
        "surrogate_sha256": hashlib.sha256(surrogate).hexdigest(),
        "expires_at": expires_at,
        "commissioned": commissioned_record(done, made_at, origin),
        ENTRY: card.pop(OWN_ENTRY),
    }
    of_modes: dict[Mode, BelievedAnswers] = {"standard": done.presses, "precise": done.scans}
    for mode, presses in of_modes.items():
        kept = {name: value for name, value in card["modes"][mode].items() if name not in KEYS_OF_DESIGN}
        card["modes"][mode] = kept | asdict(done.critical[mode]) | _worth(mode, presses)
    text = (json.dumps(card, indent=1, allow_nan=False) + "\n").encode()
    page = commissioning_page(done, card, advice, lacks=lacks, is_simulated=is_simulated).encode()
    kept_files = {MODEL_FILE: files[MODEL_FILE], RANGE_FILE: files[OWN_RANGE_FILE]}
    kept_files |= {SURROGATE_FILE: surrogate, CARD_FILE: text, PAGE_FILE: page}
    write_folder(folder, kept_files | ({CERTIFICATE_FILE: certificate.to_json().encode()} if certificate else {}))


def require_new(folder: Path) -> None:
    """Raise `InvalidQuantity` for a folder of a bundle that is there."""
    if folder.exists():
        raise InvalidQuantity("bundle", folder, "a new folder", "a bundle is written once: give another name")


def quick_folder(folder: Path) -> Path:
    """Return where the bundle of mode quick stands, beside that of ramps."""
    folder = folder.resolve()
    return folder.with_name(f"{folder.name}-quick")


def write_own_quick(made: OwnQuick, ramps: Path) -> None:
    """Write the bundle of a commissioned probe's mode quick beside that of its `ramps`, whole or not at all.

    Serial, command, forward model and until when it holds are the former's.
    """
    card, dial = json.loads((ramps / CARD_FILE).read_bytes()), believed_dial("quick", made.believed)
    export_quick(
        made.trained,
        quick_folder(ramps),
        surrogate_sha256=card["surrogate_sha256"],
        serials=tuple(card["serials"]),
        software_version=__version__,
        training_command=card["training_command"],
        more={"expires_at": card["expires_at"]},
        worth={"dial": dial} if dial else {},
    )


def _worth(mode: Mode, found: BelievedAnswers) -> dict[str, Any]:
    """Return what the card says of a mode's answers: to presses that are as commissioning believes."""
    dial = believed_dial(mode, found)
    worth = {"simulated": statistics(found.answered)} | ({"dial": dial} if dial else {})
    if not FRAMES[mode].is_scan:
        return worth
    return worth | {
        "reachable_half_width": reachable_half_width(found.as_shown),
        "half_width_by_ramps": half_width_by_ramps(found.as_shown, found.ramps),
    }


def commissioned_record(done: CommissionedProbe, made_at: datetime, origin: dict[str, Any]) -> dict[str, Any]:
    """Return what the card says of the commissioning: the probe, its model error, phantoms left out, gates."""
    std, prior = np.sqrt(np.diag(done.fit.covariance)), done.fit.prior
    return {
        "made_at": written(made_at),
        "software_sha256": source_sha256(),
        **origin,
        **done.fit.believed._asdict(),
        "probe": {
            NAMES[number]: {
                "mean": round(float(mean), 5),
                "std": round(float(own), 5),
                "expected": round(float(prior.mean[number]), 5),
                "tolerance": round(float(prior.std[number]), 5),
            }
            for number, mean, own in zip(PROBE, done.fit.mean, std, strict=True)
        },
        "phantoms_left_out": [
            {
                "name": one.name,
                **{part: np.round(getattr(one, part), 3).tolist() for part in ("truth", "value", "low", "high")},
                "is_determined": one.is_determined.tolist(),
                "misfit_ratio": round(one.misfit_ratio, 3),
            }
            for one in done.phantoms
        ],
        "gates": [gate.as_record() for gate in done.gates],
    }
