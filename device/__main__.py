"""`python -m device`: start the daemon, analyse or record presses, see settings and faults, test, update, save, darken.

Exit codes: 0 ok, 1 failed, 2 usage.
"""

from __future__ import annotations

import argparse
import faulthandler
import logging
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from device.assembly.opened_parts import StartFailed
from device.assembly.probe import open_phantom_press, open_probe, open_simulated_probe
from device.commands.analyse import add_analyse_command, run_analyse_command
from device.commands.backup import add_backup_command, run_backup_command
from device.commands.calibration import add_calibration_command, run_calibration_command
from device.commands.config import add_config_command, run_config_command
from device.commands.faults import add_faults_command, run_faults_command
from device.commands.led_off import led_off
from device.commands.record import add_record_command, run_record_command
from device.commands.restore import add_restore_command, run_restore_command
from device.commands.self_test import add_self_test_command, run_self_test_command
from device.commands.serve import refusal_noted, serve
from device.commands.support import add_support_command, run_support_command
from device.commands.update import add_update_command
from device.config import Config, simulated_config
from device.errors import DeviceError
from device.fallback.start_note import clear_note
from device.instrument.press.phantom_press import PhantomPress
from device.instrument.procedure import Procedure
from device.measurement.bundle import BundleRefused
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.settings.last_good import StartSettings, start_settings
from device.settings.layers import ROOT, layer_files, overridden, read_layers
from device.simulation.scenario import Scenario, read_scenario
from device.update.__main__ import run_update

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
    commands = parser.add_subparsers(dest="command", metavar="VERB", title="verbs")
    add_analyse_command(commands)
    add_record_command(commands)
    add_config_command(commands)
    add_calibration_command(commands)
    add_faults_command(commands)
    add_self_test_command(commands)
    add_update_command(commands)
    add_backup_command(commands)
    add_restore_command(commands)
    add_support_command(commands)
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
            return run_analyse_command(options)
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
        if options.command == "update":
            return run_update(options)
        if options.command == "backup":
            return run_backup_command(options, _start_settings(options, _scenario(options)).config)
        if options.command == "restore":
            return run_restore_command(options, _stated(options))
        if options.command == "support":
            return run_support_command(options)
        if options.command == "led-off":
            led_off(_start_settings(options, None).config.light)
            return 0
        return _serve(options)
    except (DeviceError, StartFailed, InvalidQuantity, BundleRefused) as error:
        print(error, file=sys.stderr)
        return 1


def _serve(options: argparse.Namespace) -> int:
    with refusal_noted(options.root):
        scenario = _scenario(options)
        settings = _start_settings(options, scenario)
        return serve(settings, lambda: _opened(settings.config, scenario), lambda: clear_note(options.root))


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


def _stated(options: argparse.Namespace) -> Mapping[str, Any]:
    """Return what this machine's settings files say, by full names; of a simulated probe its own settings."""
    scenario = _scenario(options)
    if scenario and not options.config:
        return vars(simulated_config(scenario.serial))
    return read_layers(layer_files(options.root, options.config)).values


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


if __name__ == "__main__":
    faulthandler.enable()  # the watchdog's SIGABRT then writes where every thread was
    sys.exit(main())
