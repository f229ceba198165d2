"""The models and the certificate of a probe to its answers: in which modes it can be pressed, and what estimates each.

A mode is offered only when its model is there; the mode of the settings must be one of those. Between presses the
models prove themselves on their golden vectors: an inference that hangs or errs is known before a press needs it.
The certificate is the active one, once it is for this probe, its model and its settings.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path

from device.assembly.opened_parts import OpenedParts
from device.config import Config
from device.errors import ConfigError, DeviceError, ForeignCalibration, MissingCalibration, ModelError
from device.files.bundle_file import read_models, read_paper_model
from device.instrument.press.probe_answers import ProbeAnswers
from device.instrument.press.remembered_ramps import RememberedRamps
from device.measurement.bundle import BundleRefused, ModelBundle
from device.measurement.calibration import Calibration
from device.measurement.estimate import Estimate
from device.measurement.mode import Mode
from device.measurement.mode_models import ModeModels
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.camera_geometry import CameraGeometry
from device.measurement.recording.recording import Recording
from device.measurement.scan_advice import ScanAdvice
from device.records.calibrations import Calibrations

log = logging.getLogger(__name__)
NAME_ANOTHER = "Correct the path, copy the bundle there, or take the setting out."


def active_calibration(config: Config, bundle: ModelBundle) -> Calibration | None:
    """Return the active certificate, None for a probe that was never calibrated; its dates are not looked at.

    Raises `MissingCalibration` when the one that is named cannot be used, `ForeignCalibration` when it is not for this
    probe, with all that tells.
    """
    calibration = Calibrations(config.calibration).active()
    if calibration:
        require_own(calibration, config, bundle)
    return calibration


def require_own(calibration: Calibration, config: Config, bundle: ModelBundle) -> None:
    """Raise `ForeignCalibration` with everything by which a certificate is not for this probe and its settings."""
    problems = [str(problem) for problem in _foreign(calibration, config, bundle)]
    if problems:
        raise ForeignCalibration(" ".join(problems), "Then start the daemon again.")


def _foreign(calibration: Calibration, config: Config, bundle: ModelBundle) -> Iterator[InvalidQuantity]:
    yield from calibration.foreign(config.serial, bundle)
    lines = calibration.lines
    if lines and not lines.holds_at(config.press.target_n):
        bound = f"{lines.force_n:g} N as calibrated"
        action = "set that force, or calibrate with this one"
        yield InvalidQuantity("press.target_n", config.press.target_n, bound, action)
    camera = config.camera
    yield from calibration.other_settings(
        CameraGeometry(camera.scale, camera.axis_x_mm, camera.axis_y_mm, camera.rim_distortion_percent),
        exposure_us=camera.exposure_us,
        gain=camera.gain,
        cell_counts_per_n=config.cell.sensitivity_counts_per_n,
    )


def answers_for(config: Config, bundle: ModelBundle, calibration: Calibration | None) -> ProbeAnswers:
    """Return what a probe can answer; without a calibration its estimator raises `MissingCalibration`.

    Mode paper is none of its modes where the certificate has no lines, or lines of another press than the model.
    Raises `BundleRefused` or `InvalidQuantity` when the model of another mode is there but does not hold, or was not
    made together with the others; `ForeignCalibration` when mode paper would be the only one and is none.
    """
    ramps = RememberedRamps()
    models = read_models(bundle, config.quick_model, config.standard_model).for_probe(config.serial)
    models.require_made_together(calibration)
    models = models._replace(read=ramps.profiles)

    def certificate() -> Calibration:
        if calibration is None:
            raise MissingCalibration("The probe is not calibrated.", "Calibrate it and activate the certificate.")
        return calibration

    def estimate(recording: Recording, mode: Mode) -> Estimate:
        return models.estimate(recording, mode, certificate())

    def advise(recording: Recording) -> ScanAdvice:
        return models.advise(recording, certificate())

    modes = tuple(mode for mode in models.modes if mode != "paper" or _has_lines(calibration, bundle, models.modes))
    worth = {mode: models.worth(mode) for mode in modes}
    return ProbeAnswers(
        modes,
        estimate,
        advise,
        lambda: _prove(models),
        worth,
        ramps.look_beside,
        models.expires_at,
        models.flat_field_ratio,
    )


def _has_lines(calibration: Calibration | None, bundle: ModelBundle, modes: tuple[Mode, ...]) -> bool:
    """Return whether a certificate lets mode paper answer; a network of another press is told, and the others go on."""
    if calibration is None or calibration.lines is None:
        return calibration is None
    problems = " ".join(map(str, calibration.lines.other_press(bundle)))
    if problems and modes == ("paper",):
        raise ForeignCalibration(problems, "Then start the daemon again.")
    if problems:
        log.warning("mode paper is not offered: %s", problems)
    return not problems


def answers_of_start(config: Config, bundle: ModelBundle, calibration: Calibration | None) -> ProbeAnswers:
    """Return what `answers_for` returns, once it has all that the settings name; raises `ConfigError`, too."""
    answers = answers_for(config, bundle, calibration)
    answers.mode_unless_asked(config.press.mode)
    require_named_models(config, answers)
    return answers


def faults_at_start(config: Config) -> list[DeviceError]:
    """Return every fault of models and certificate with which the daemon does not start; no hardware is opened."""
    parts = OpenedParts()
    bundle = parts.open(lambda: read_paper_model(config.paper_model))
    if bundle:
        calibration = parts.open(lambda: active_calibration(config, bundle))
        parts.open(lambda: answers_of_start(config, bundle, calibration))
    return parts.faults


def require_named_models(config: Config, answers: ProbeAnswers) -> None:
    """Raise `ConfigError` when the settings name a model that is not there, or not for this probe.

    Those that every release brings are the simulated probe's: another probe has to do without, and does.
    """
    for setting, path, mode in _named_models(config):
        if mode not in answers.modes:
            cause = f"{setting} is {path}, which holds no model of mode {mode} for {config.serial}."
            raise ConfigError(cause, NAME_ANOTHER)


def require_named_folders(config: Config) -> None:
    """Raise `ConfigError` when the settings name a model whose folder is not there, before anything is read by them."""
    for setting, path, mode in _named_models(config):
        if not path.is_dir():
            raise ConfigError(f"{setting} is {path}, but must be a folder with a model of mode {mode}.", NAME_ANOTHER)


def _named_models(config: Config) -> Iterator[tuple[str, Path, Mode]]:
    """Yield setting, folder and mode of each model that is another than the release's."""
    named: dict[str, tuple[Path, Path, Mode]] = {
        "standard_model": (config.standard_model, Config.standard_model, "standard"),
        "quick_model": (config.quick_model, Config.quick_model, "quick"),
    }
    for setting, (path, of_release, mode) in named.items():
        if path != of_release:
            yield setting, path, mode


def _prove(models: ModeModels) -> None:
    """Raise `ModelError` when a model does not answer its golden vectors any more."""
    try:
        models.prove()
    except BundleRefused as error:
        raise ModelError(str(error), "Then start the daemon again.") from error
