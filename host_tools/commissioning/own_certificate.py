"""Ramps on phantoms to the certificate of a commissioned probe: how long it holds, and by what drift is watched.

It has no lines of mode paper. These are fitted on features at one force that tables of this very waveguide say, which a
probe within its tolerances does not have; the modes that are commissioned read none of them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from datetime import timedelta

from device import __version__
from device.measurement.calibration import Calibration, Validity, certificate_id, moment, written
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.recording import Recording
from host_tools.calibration.certified_probe import (
    flat_field_ratio,
    frames_beside,
    oldest_at,
    source_sha256,
    untouched_face,
)
from host_tools.calibration.gates import age_gate, agreed_cell, disagreements, light_gates, require_all
from host_tools.scenes.probe import Probe

RECORD = "record the phantom by `python -m device record`"


def own_certificate(
    recordings: Sequence[Recording],
    names: Sequence[str],
    probe: Probe,
    *,
    phantom_serial: str,
    operator: str,
    made_at: str,
    valid_days: float,
    block_names: Collection[str] = (),
) -> Calibration:
    """Return the certificate of a probe by its recordings of phantoms of these names, some of them bare blocks.

    The camera's geometry is that of the probe's file. It holds for `valid_days` from the oldest recording, or from
    `made_at` (RFC 3339) where all are simulated. Raises `CalibrationRejected` with everything that the recordings lack.
    """
    require_all((), _problems(recordings, names))
    seen = [replace(one, camera=one.camera.seen_as(probe.geometry)) for one in recordings]
    validity, untouched = validity_of(seen, made_at, valid_days), untouched_face(seen)
    gates = [*light_gates(seen, untouched), age_gate(validity, made_at)]
    require_all(gates, disagreements(seen, phantom_serial))
    certificate = Calibration(
        id="",
        made_at=made_at,
        validity=validity,
        operator=operator,
        serial=probe.serial,
        phantom_serial=phantom_serial,
        camera=seen[0].camera,
        cell=agreed_cell(seen),
        untouched=untouched,
        phantoms=len(seen),
        flat_field_ratio=flat_field_ratio([one for one, name in zip(seen, names, strict=True) if name in block_names]),
        software=__version__,
        software_sha256=source_sha256(),
        simulated=any(one.simulated for one in seen),
    )
    return replace(certificate, id=certificate_id(certificate))


def _problems(recordings: Sequence[Recording], names: Sequence[str]) -> Iterator[InvalidQuantity]:
    """Yield what single recordings lack of what a certificate says."""
    for name, recording in zip(names, recordings, strict=True):
        if recording.cell is None:
            yield InvalidQuantity(f"cell of {name}", "missing", "slope and tare of the load cell", RECORD)
        try:
            frames_beside(recording)
        except InvalidQuantity as error:
            yield InvalidQuantity(f"{error.quantity} of {name}", error.value, error.bound, error.action)


def validity_of(recordings: Sequence[Recording], made_at: str, valid_days: float) -> Validity:
    """Return how long bundles and certificate of the recordings hold: so many days from the oldest one.

    Simulated ones are of 1970 by convention, and no older than today."""
    oldest = oldest_at(recordings)
    begin = made_at if all(one.simulated for one in recordings) else oldest
    expires = moment(begin, "made_at") + timedelta(days=valid_days)
    return Validity(oldest, written(expires))
