"""`python -m device analyse`: recordings to their estimates, one line of JSON each. Exit code 0."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from device.assembly.answers import answers_for
from device.config import Config, simulated_config
from device.files.bundle_file import read_paper_model
from device.files.recording_file import read_recording
from device.instrument.press.probe_answers import ProbeAnswers
from device.instrument.watch.calibration_watch import CalibrationWatch
from device.measurement.mode import mode_named
from device.measurement.mode_models import mode_of_recording
from device.records.calibrations import Calibrations
from device.settings.layers import read_config


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what the verb takes to its own parser."""
    parser.add_argument("--mode", help="quick, standard, precise or paper; what its frames are for unless given")
    parser.add_argument("recordings", type=Path, nargs="+", metavar="RECORDING")


def run(options: argparse.Namespace) -> int:
    """Estimate recordings by the settings of a file, or those of the simulated probe that made them.

    The certificate has to have held when they were recorded.
    """
    stated = read_config(options.config) if options.config else None
    of_probe: dict[str, tuple[CalibrationWatch, ProbeAnswers]] = {}
    for path in options.recordings:
        recording = read_recording(path)
        if recording.serial not in of_probe:
            of_probe[recording.serial] = _answers_of(recording.serial, stated)
        calibration, answers = of_probe[recording.serial]
        calibration.require_valid(recording.started_at)
        mode = mode_named(options.mode) if options.mode else mode_of_recording(recording)
        estimate = answers.estimator(recording, mode)
        print(json.dumps({"recording": str(path), **estimate.as_record()}))
    return 0


def _answers_of(serial: str, stated: Config | None) -> tuple[CalibrationWatch, ProbeAnswers]:
    """Return certificate and answers of the probe with a serial number, refusing those of another probe or model."""
    config = stated or simulated_config(serial)
    bundle = read_paper_model(config.paper_model)
    calibration = Calibrations(config.calibration).active()
    if calibration:
        calibration.require_for(serial, bundle)
    return CalibrationWatch(calibration), answers_for(config, bundle, calibration)
