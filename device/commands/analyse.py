"""`python -m device analyse`: recordings to their estimates, one line of JSON each.

Exit codes: 0 ok, 1 a recording is refused: what is wrong with it is told, and the others are answered.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from device.assembly.answers import answers_for
from device.config import SIMULATED, Config, simulated_config
from device.errors import DeviceError
from device.files.bundle_file import read_paper_model
from device.files.plain_settings import layer_files
from device.files.recording_file import read_recording
from device.instrument.press.probe_answers import ProbeAnswers
from device.instrument.watch.calibration_watch import CalibrationWatch
from device.measurement.bundle import BundleRefused
from device.measurement.estimate import Estimate
from device.measurement.mode import mode_named
from device.measurement.mode_models import mode_of_recording
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.recording import Recording
from device.records.calibrations import Calibrations
from device.settings.layers import read_config, read_layers


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.add_argument("--mode", help="quick, standard, precise or paper; what its frames are for unless given")
    parser.add_argument("recordings", type=Path, nargs="+", metavar="RECORDING")


def run(options: argparse.Namespace) -> int:
    """Estimate recordings by the settings of a file, or by those of the probe that made them.

    The certificate has to have held when they were recorded. What is refused is told, and the next one is answered.
    """
    stated = read_config(options.config) if options.config else None
    asked = mode_named(options.mode) if options.mode else None
    of_probe: dict[str, tuple[CalibrationWatch, ProbeAnswers]] = {}

    def answer_to(recording: Recording) -> Estimate:
        """Return what a recording's own probe answers; its models are opened at the first of its recordings."""
        if recording.serial not in of_probe:
            config = stated or _settings_of(recording.serial, options.root)
            of_probe[recording.serial] = _answers_of(recording.serial, config)
        calibration, answers = of_probe[recording.serial]
        calibration.require_valid(recording.started_at)
        return answers.estimator(recording, asked or mode_of_recording(recording))

    code = 0
    for path in options.recordings:
        try:
            recording = read_recording(path)
            estimate = answer_to(recording).as_record()
            print(json.dumps({"recording": str(path), **estimate, **_made_by(recording)}))
        except (DeviceError, InvalidQuantity, BundleRefused) as error:
            print(f"{path}: {error}", file=sys.stderr)
            code = 1
    return code


def _made_by(recording: Recording) -> dict[str, str]:
    """Return which probe recorded with which software and when, by the names that a measurement has."""
    return {"serial": recording.serial, "taken_at": recording.started_at, "software": recording.software}


def _settings_of(serial: str, root: Path) -> Config:
    """Return the settings of the probe with a serial number: the simulated one's, or those below a root.

    Another probe's settings would answer by its models: they are refused, and so is a machine without any.
    """
    if serial in SIMULATED:
        return simulated_config(serial)
    layers = read_layers(layer_files(root))
    own = layers.values.get("serial")
    if own == serial or (own is None and layers.problems):
        return layers.config()
    simulated = " or ".join(SIMULATED)
    bound = f"{own} as in this machine's settings" if own else f"{simulated} where no settings name another"
    raise InvalidQuantity("serial of the recording", serial, bound, "name its probe's settings with --config FILE")


def _answers_of(serial: str, config: Config) -> tuple[CalibrationWatch, ProbeAnswers]:
    """Return certificate and answers of the probe with a serial number, refusing those of another probe or model."""
    bundle = read_paper_model(config.paper_model)
    calibration = Calibrations(config.calibration).active()
    if calibration:
        calibration.require_for(serial, bundle)
    return CalibrationWatch(calibration), answers_for(config, bundle, calibration)
