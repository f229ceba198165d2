"""`python -m device`: start the daemon, analyse or record presses, see settings, certificates and faults, test, darken.

Exit codes: 0 ok, 1 failed, 2 usage.
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import logging
import signal
import socket
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import uvicorn

from device.assembly.answers import Answers, answers_for
from device.assembly.opened_parts import StartFailed
from device.assembly.probe import open_phantom_press, open_probe, open_simulated_probe
from device.commands.calibration import add_calibration_command, run_calibration_command
from device.commands.config import add_config_command, run_config_command
from device.commands.faults import add_faults_command, run_faults_command
from device.commands.led_off import led_off
from device.commands.record import add_record_command, run_record_command
from device.commands.self_test import add_self_test_command, run_self_test_command
from device.config import Config, simulated_config
from device.errors import DeviceError
from device.files.bundle_file import read_paper_model
from device.files.recording_file import read_recording
from device.instrument.press.phantom_press import PhantomPress
from device.instrument.procedure import Procedure
from device.instrument.watch.calibration_watch import CalibrationWatch
from device.instrument.watch.restart_note import RestartNote
from device.instrument.watch.watchdog import Watchdog
from device.measurement.bundle import BundleRefused
from device.measurement.mode import mode_named, mode_of
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.records.calibrations import Calibrations
from device.settings.last_good import StartSettings, start_settings
from device.settings.layers import ROOT, layer_files, overridden, read_config, read_layers
from device.simulation.scenario import Scenario, read_scenario
from device.web.app import create_app

EXAMPLES = """examples:
  python -m device --simulate --port 8000          the virtual probe, screen at http://127.0.0.1:8000/
  python -m device --simulate --scene scene.toml   the same on another inclusion
  python -m device analyse recording/ press.zip    JSON estimates, one a line
  python -m device config check                    every problem of the settings files
  python -m device self-test --simulate            every part with measured value and verdict
  python -m device led-off                         darken the LEDs of a daemon that was killed
"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m device", epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="The probe's daemon: screen and REST API of a tactile probe, real or simulated.",
    )  # fmt: skip
    parser.add_argument("--simulate", action="store_true", help="emulate LED chip, load cell and camera")
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings (TOML) over all others")
    parser.add_argument(
        "--root", type=Path, metavar="DIR", default=ROOT, help="folder that holds etc/tsis and usr/lib/tsis"
    )
    parser.add_argument("--scene", type=Path, metavar="FILE", help="what the simulated probe is pressed on (TOML)")
    parser.add_argument("--port", type=int, help="port of the screen and the API")
    verbs = "analyse | record | config | calibration | faults | self-test | led-off"
    commands = parser.add_subparsers(dest="command", metavar=verbs)
    analyse = commands.add_parser("analyse", help="print the estimate of each recording as one line of JSON")
    analyse.add_argument("--mode", help="quick, standard, precise or paper; what its frames are for unless given")
    analyse.add_argument("recordings", type=Path, nargs="+", metavar="RECORDING")
    add_record_command(commands)
    add_config_command(commands)
    add_calibration_command(commands)
    add_faults_command(commands)
    add_self_test_command(commands)
    commands.add_parser("led-off", help="darken the LED chip of the real probe")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line; return its exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.scene and not options.simulate:
        parser.error("--scene says what the *simulated* probe is pressed on: add --simulate")
    if options.command == "led-off" and options.simulate:
        parser.error("led-off darkens the chip of a real probe: leave out --simulate")
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
    try:
        if options.command == "analyse":
            return _analyse(options)
        if options.command == "record":
            return _record(options)
        if options.command == "config":
            return run_config_command(options)
        if options.command == "calibration":
            scenario = _scenario(options)
            return run_calibration_command(options, _start_settings(options, scenario).config)
        if options.command == "faults":
            return run_faults_command(options)
        if options.command == "self-test":
            return _self_test(options)
        if options.command == "led-off":
            led_off(_start_settings(options, None).config.light)
            return 0
        return _serve(options)
    except (DeviceError, StartFailed, InvalidQuantity, BundleRefused) as error:
        print(error, file=sys.stderr)
        return 1


def _start_settings(options: argparse.Namespace, scenario: Scenario | None) -> StartSettings:
    """Return the settings: those of this machine's files, or the simulated probe's own, or what its one file says.

    Those of the scene lie over the simulated probe's.
    """
    if not scenario:
        settings = start_settings(read_layers(layer_files(options.root, options.config)))
    elif options.config:
        settings = start_settings(read_layers([options.config]))
    else:
        settings = StartSettings(simulated_config(scenario.serial))
    if scenario:
        settings = replace(settings, config=overridden(settings.config, scenario.settings))
    if options.port is None:
        return settings
    return replace(settings, config=overridden(settings.config, {"server": {"port": options.port}}))


def _analyse(options: argparse.Namespace) -> int:
    """Estimate recordings by the settings of a file, or those of the simulated probe that made them.

    The certificate has to have held when they were recorded.
    """
    stated = read_config(options.config) if options.config else None
    of_probe: dict[str, tuple[CalibrationWatch, Answers]] = {}
    for path in options.recordings:
        recording = read_recording(path)
        if recording.serial not in of_probe:
            of_probe[recording.serial] = _answers_of(recording.serial, stated)
        calibration, answers = of_probe[recording.serial]
        calibration.require_valid(recording.started_at)
        mode = mode_named(options.mode) if options.mode else mode_of([f.force_n for f in recording.with_role("press")])
        estimate = answers.estimator(recording, mode)
        print(json.dumps({"recording": str(path), **estimate.as_record()}))
    return 0


def _scenario(options: argparse.Namespace) -> Scenario | None:
    if not options.simulate:
        return None
    return read_scenario(options.scene) if options.scene else Scenario()


def _opened(config: Config, scenario: Scenario | None) -> Procedure:
    return open_simulated_probe(config, scenario) if scenario else open_probe(config)


def _self_test(options: argparse.Namespace) -> int:
    scenario = _scenario(options)
    config = _start_settings(options, scenario).config
    return run_self_test_command(options, lambda: _opened(config, scenario))


def _record(options: argparse.Namespace) -> int:
    """Record one press on a phantom: it is what a virtual probe is pressed on, whatever its scene says."""
    scenario = _scenario(options)
    settings = _start_settings(options, scenario)
    if settings.warning:
        print(f"{settings.warning.code} {settings.warning}", file=sys.stderr)

    def opened(inclusion: Inclusion) -> PhantomPress:
        return open_phantom_press(settings.config, scenario and replace(scenario, inclusion=inclusion))

    return run_record_command(options, opened)


def _answers_of(serial: str, stated: Config | None) -> tuple[CalibrationWatch, Answers]:
    """Return certificate and answers of the probe with a serial number, refusing those of another probe or model."""
    config = stated or simulated_config(serial)
    bundle = read_paper_model(config.paper_model)
    calibration = Calibrations(config.calibration).active()
    if calibration:
        calibration.require_for(serial, bundle)
    return CalibrationWatch(calibration), answers_for(config, bundle, calibration)


def _serve(options: argparse.Namespace) -> int:
    scenario = _scenario(options)
    settings = _start_settings(options, scenario)
    config = settings.config
    listening = _listen(config)
    with listening:
        procedure = _opened(config, scenario)
        note = RestartNote(config.data)
        warnings = tuple(warning for warning in (settings.warning, note.warning()) if warning)
        procedure.board.update(warnings=warnings)
        watchdog = Watchdog(procedure.progress, procedure.board, note)
        procedure.start()
        watchdog.start()
        try:
            if procedure.bench.force.fault is None:  # else `cell.device` may be what is wrong
                settings.keep()
            _run_server(procedure, listening)
        finally:
            try:
                watchdog.close()
            finally:
                procedure.close()
    return 0


def _listen(config: Config) -> socket.socket:
    """Take the port before any hardware is opened; raise `DeviceError` when it is in use."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    host, port = config.server.host, config.server.port
    try:
        listening.bind((host, port))
        listening.listen()
    except OSError as error:
        listening.close()
        raise DeviceError(
            f"Port {port} of {host} cannot be used: {error.strerror}.", "Choose another with --port."
        ) from error
    return listening


def _run_server(procedure: Procedure, listening: socket.socket) -> None:
    host, port = listening.getsockname()
    kind = "simulated probe" if procedure.is_simulated else "probe"
    print(f"TSIS {kind} {procedure.config.serial}: screen and API at http://{host}:{port}/", flush=True)
    app = create_app(procedure, procedure.store)
    # Open event streams never end by themselves; without the limit a stop would wait for them.
    settings = uvicorn.Config(app, log_level="warning", timeout_graceful_shutdown=1, lifespan="off")
    server = uvicorn.Server(settings)
    signal.signal(signal.SIGTERM, lambda *_: setattr(server, "should_exit", True))
    server.run(sockets=[listening])


if __name__ == "__main__":
    faulthandler.enable()  # the watchdog's SIGABRT then writes where every thread was
    sys.exit(main())
