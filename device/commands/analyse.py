"""`python -m device analyse`: recordings to their estimates, one line of JSON each.

Exit codes: 0 ok, 1 a recording is refused: what is wrong with it is told, and the others are answered.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from device import __version__
from device.assembly.answers import answers_for, require_named_folders
from device.config import SIMULATED, Config, simulated_config
from device.errors import DeviceError
from device.files.bundle_file import read_paper_model
from device.files.plain_settings import layer_files
from device.files.recording_file import read_recording
from device.instrument.press.probe_answers import ProbeAnswers
from device.measurement.bundle import BundleRefused
from device.measurement.calibration import Calibration
from device.measurement.mode import mode_named
from device.measurement.mode_models import mode_of_recording
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.recording import Recording
from device.records.calibrations import Calibrations
from device.settings.layers import read_config, read_layers


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.add_argument("--mode", help="quick, standard, precise or paper; what its frames are for unless given")
    parser.add_argument("--any-time", action="store_true", help="answer also what was recorded outside its validity")
    parser.add_argument("recordings", type=Path, nargs="+", metavar="RECORDING")


def run(options: argparse.Namespace) -> int:
    """Estimate recordings by the settings of a file, or by those of the probe that made them.

    The certificate has to have held when they were recorded, unless any time will do: then the answer says whether it
    did. What is refused is told, and the next one is answered.
    """
    stated = read_config(options.config) if options.config else None
    if stated:
        require_named_folders(stated)
    asked = mode_named(options.mode) if options.mode else None
    of_probe: dict[str, tuple[Calibration | None, ProbeAnswers]] = {}

    def answer_to(recording: Recording) -> dict[str, Any]:
        """Return what a recording's own probe answers; its models are opened at the first of its recordings."""
        if recording.serial not in of_probe:
            config = stated or _settings_of(recording.serial, options.root)
            of_probe[recording.serial] = _answers_of(recording.serial, config)
        calibration, answers = of_probe[recording.serial]
        problem = _not_held(calibration, recording.started_at)
        if problem and not options.any_time:
            raise problem
        estimate = answers.estimator(recording, asked or mode_of_recording(recording))
        return {**estimate.as_record(), **_made_by(recording), "certificate_held": problem is None}

    code = 0
    for path in options.recordings:
        try:
            recording = read_recording(path)
            print(json.dumps({"recording": str(path), **answer_to(recording)}))
        except (DeviceError, InvalidQuantity, BundleRefused) as error:
            print(f"{path}: {error}", file=sys.stderr)
            code = 1
    return code


def _made_by(recording: Recording) -> dict[str, str]:
    """Return who recorded and when, by the names that a measurement has, and which software answers."""
    recorded = {"recording_id": recording.id, "serial": recording.serial, "taken_at": recording.started_at}
    return {**recorded, "software": recording.software, "answered_by": __version__}


def _not_held(calibration: Calibration | None, recorded_at: str) -> InvalidQuantity | None:
    """Return what is wrong where a certificate did not hold when a press was recorded; without one there is no answer.

    A clock that is set now helps no recording: another certificate does.
    """
    if calibration is None:
        return None
    validity = calibration.validity
    if validity.is_before(recorded_at):
        bound = f"not before {validity.measured_at}, measured_at of certificate {calibration.id}"
    elif validity.days_left(recorded_at) < 0:
        bound = f"not after {validity.expires_at}, expires_at of certificate {calibration.id}"
    else:
        return None
    files = "calibration, standard_model, quick_model"
    action = f"name certificate and models of that time in --config FILE ({files}), or say --any-time"
    return InvalidQuantity("time of the recording", recorded_at, bound, action)


def _settings_of(serial: str, root: Path) -> Config:
    """Return the settings of the probe with a serial number: the simulated one's, or those below a root.

    Another probe's settings would answer by its models: they are refused, and so is a machine without any.
    """
    if serial in SIMULATED:
        return simulated_config(serial)
    layers = read_layers(layer_files(root))
    own = layers.values.get("serial")
    if own == serial or (own is None and layers.problems):
        config = layers.config()
        require_named_folders(config)
        return config
    simulated = " or ".join(SIMULATED)
    bound = f"{own} as in this machine's settings" if own else f"{simulated} where no settings name another"
    raise InvalidQuantity("serial of the recording", serial, bound, "name its probe's settings with --config FILE")


def _answers_of(serial: str, config: Config) -> tuple[Calibration | None, ProbeAnswers]:
    """Return certificate and answers of the probe with a serial number, refusing those of another probe or model."""
    bundle = read_paper_model(config.paper_model)
    calibration = Calibrations(config.calibration).active()
    if calibration:
        calibration.require_for(serial, bundle)
    return calibration, answers_for(config, bundle, calibration)
