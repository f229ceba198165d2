"""`python -m device`: start the daemon, analyse or record presses, see settings and faults, test, update, save, darken.

Each verb imports what it needs when it is asked for: a fault is looked up, and the light is off, long before what
measures has been loaded.
Exit codes: 0 ok, 1 failed, 2 usage.
"""

from __future__ import annotations

import argparse
import faulthandler
import logging
import os
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from device.errors import DeviceError
from device.measurement.quantities import InvalidQuantity

if TYPE_CHECKING:
    from device.config import Config
    from device.instrument.press.phantom_press import PhantomPress, PhantomTruth
    from device.instrument.procedure import Procedure
    from device.settings.last_good import StartSettings
    from device.simulation.scenario import Scenario

VERBS = {
    "analyse": "print the estimate of each recording as one line of JSON",
    "focus": "hold the LEDs on and print how bright and sharp the image is",
    "record": "record a press on a phantom, also without a certificate",
    "config": "check or show the settings",
    "calibration": "list, show or activate certificates",
    "faults": "list the fault codes",
    "pair": "make a code by which another machine gets a token",
    "tokens": "list the tokens of other machines, or revoke one",
    "audit": "verify that no entry of the audit was changed",
    "openapi": "print the REST API as an OpenAPI document",
    "self-test": "test every part and name the one that fails",
    "update": "install a signed release, go back",
    "backup": "save measurements, settings, certificates and own models to a file",
    "restore": "bring a backup to a card that holds no measurements yet",
    "erase": "overwrite measurements and keys of a probe that is given away",
    "status": "say what the daemon does, and what the last press was",
    "exams": "list the exams that are kept",
    "export": "write measurements to a table, arrays or an archive of recordings",
    "retention": "show which recordings the settings' rule deletes now",
    "support": "write a file for whoever helps, without patients' data",
    "dicom": "ask the hospital's archive and worklist whether they are there",
    "led-off": "darken the LED chip of the real probe",
}
OF_EVERY_VERB = {"--simulate": False, "--config": True, "--root": True, "--scene": True, "--port": True}
"""Options that stand before the verb or behind it, and whether a value follows."""
LOOKING = ("status", "exams", "export", "retention", "audit")
"""Verbs that only read what is kept, or ask the daemon: in a room of their own."""
WITHOUT_SETTINGS = ("analyse", "config", "faults", "openapi", "support")
"""Verbs whose `run` takes the options alone; that of the others takes the settings, too."""
OF_LIBRARIES = {"OPENCV_FOR_THREADS_NUM": "1", "OPENBLAS_NUM_THREADS": "1", "PYDANTIC_DISABLE_PLUGINS": "__all__"}
"""A frame is small work: more threads of a library would wait for each other. The camera's process inherits this.

There is no plugin: to look for one in all installed packages is a tenth of what `config` takes.
"""

EXAMPLES = """examples:
  python -m device --simulate --port 8000          the virtual probe, screen at http://127.0.0.1:8000/
  python -m device --simulate --scene scene.toml   the same on another inclusion
  python -m device analyse recording/ press.zip    JSON estimates, one a line
  python -m device focus                           brightness and sharpness of the image, the LEDs held on
  python -m device config check                    every problem of the settings files
  python -m device self-test --simulate            every part with measured value and verdict
  python -m device led-off                         darken the LEDs of a daemon that was killed
"""


ALIASES = {"support": ("support-bundle",)}
"""Other names of verbs."""
ALIASED = {other: verb for verb, others in ALIASES.items() for other in others}


def _parser(named: Collection[str] = tuple(VERBS)) -> argparse.ArgumentParser:
    """Return the parser; only the verbs `named` know their options."""
    parser = argparse.ArgumentParser(
        prog="python -m device", epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="The probe's daemon: screen and REST API of a tactile probe, real or simulated.",
    )  # fmt: skip
    parser.add_argument("--simulate", action="store_true", help="emulate LED chip, load cell and camera")
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings (TOML) over all others")
    parser.add_argument(
        "--root", type=Path, metavar="DIR", default=Path("/"), help="folder that holds etc/tsis and usr/lib/tsis"
    )
    parser.add_argument("--scene", type=Path, metavar="FILE", help="what the simulated probe is pressed on (TOML)")
    parser.add_argument("--port", type=int, help="port of the screen and the API")
    commands = parser.add_subparsers(dest="command", metavar="VERB", title="verbs")
    for verb, told in VERBS.items():
        its = commands.add_parser(
            verb, aliases=ALIASES.get(verb, ()), help=told, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        if verb in named:
            module = import_module(_module_of(verb))
            module.add_options(its)
    return parser


def _module_of(verb: str) -> str:
    return f"device.commands.{'look.' if verb in LOOKING else ''}{verb.replace('-', '_')}"


def in_any_order(arguments: Sequence[str]) -> list[str]:
    """Return a command line with the options of every verb before it, and its own behind it, wherever they stood.

    What is after -- stays.
    """
    ahead, rest, words = list[str](), list[str](), iter(arguments)
    for word in words:
        name, given, _ = word.partition("=")
        if word == "--":
            return [*ahead, *_verb_first(rest), word, *words]
        takes_value = OF_EVERY_VERB.get(name)
        where = rest if takes_value is None else ahead
        where.append(word)
        if takes_value and not given and (value := next(words, None)) is not None:
            where.append(value)
    return [*ahead, *_verb_first(rest)]


def _verb_first(words: list[str]) -> list[str]:
    """Return a verb before its own options where one of those stands first."""
    verb = next((word for word in words if word in VERBS or word in ALIASED), None)
    if verb is None or words[0] in ("-h", "--help") or not words[0].startswith("-"):
        return words
    at = words.index(verb)
    return [verb, *words[:at], *words[at + 1 :]]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line; return its exit code."""
    for name, value in OF_LIBRARIES.items():
        os.environ.setdefault(name, value)
    arguments = in_any_order(sys.argv[1:] if arguments is None else arguments)
    parser = _parser([verb for verb in VERBS if {verb, *ALIASES.get(verb, ())} & set(arguments)])
    options = parser.parse_args(arguments)
    if options.scene and not options.simulate:
        parser.error("--scene says what the *simulated* probe is pressed on: add --simulate")
    if options.command == "led-off" and options.simulate:
        parser.error("led-off darkens the chip of a real probe: leave out --simulate")
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
    try:
        code = _run(options)
        sys.stdout.flush()
        return code
    except BrokenPipeError:  # whoever read along, as `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (DeviceError, InvalidQuantity) as error:
        print(error, file=sys.stderr)
    except _refusals() as error:
        print(error, file=sys.stderr)
    return 1


def _refusals() -> tuple[type[Exception], ...]:
    """Return what else may be refused; who raised it has imported where it is from."""
    from device.assembly.opened_parts import StartFailed
    from device.measurement.bundle import BundleRefused

    return StartFailed, BundleRefused


def _run(options: argparse.Namespace) -> int:
    command: str | None = options.command
    match ALIASED.get(command or "", command):
        case None:
            return _serve(options)
        case "focus":
            return _focus(options)
        case "record":
            return _record(options)
        case "self-test":
            return _self_test(options)
        case "update":
            from device.update.__main__ import run_update

            return run_update(options)
        case "restore":
            from device.commands.restore import run_restore_command

            return run_restore_command(options, _stated(options))
        case "erase":
            from device.commands.erase import run_erase_command

            return run_erase_command(options, _started(options), _stated(options))
        case "led-off":
            from device.commands.led_off import led_off_by_settings
            from device.files.plain_settings import layer_files

            led_off_by_settings(layer_files(options.root, options.config))
            return 0
        case verb:
            run: Callable[..., int] = import_module(_module_of(verb)).run
            return run(options) if verb in WITHOUT_SETTINGS else run(options, _started(options))


def _started(options: argparse.Namespace) -> Config:
    """Return the settings that a daemon would start with."""
    return _start_settings(options, _scenario(options)).config


def _serve(options: argparse.Namespace) -> int:
    from device.commands.serve import refusal_noted, serve
    from device.files.start_note import clear_note

    with refusal_noted(options.root):
        scenario = _scenario(options)
        settings = _start_settings(options, scenario)
        return serve(settings, lambda: _opened(settings.config, scenario), lambda: clear_note(options.root))


def _start_settings(options: argparse.Namespace, scenario: Scenario | None) -> StartSettings:
    """Return the settings: those of this machine's files, or the simulated probe's own, or what its one file says.

    Those of the scene lie over the simulated probe's.
    """
    from device.config import simulated_config
    from device.files.plain_settings import layer_files
    from device.settings.last_good import StartSettings, start_settings
    from device.settings.layers import overridden, read_layers

    if not scenario:
        settings = start_settings(read_layers(layer_files(options.root, options.config)), options.root)
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
    from device.config import simulated_config
    from device.files.plain_settings import layer_files
    from device.settings.layers import read_layers

    scenario = _scenario(options)
    if scenario and not options.config:
        return vars(simulated_config(scenario.serial))
    return read_layers(layer_files(options.root, options.config)).values


def _scenario(options: argparse.Namespace) -> Scenario | None:
    if not options.simulate:
        return None
    from device.simulation.scenario import Scenario, read_scenario

    return read_scenario(options.scene) if options.scene else Scenario()


def _opened(config: Config, scenario: Scenario | None) -> Procedure:
    if scenario:
        from device.assembly.probe import open_simulated_probe

        return open_simulated_probe(config, scenario)
    from device.assembly.camera import real_camera

    camera = real_camera(config.camera)  # its process starts while this one imports the rest
    from device.assembly.probe import open_probe

    return open_probe(config, camera)


def _self_test(options: argparse.Namespace) -> int:
    from device.commands.self_test import run_self_test_command

    scenario = _scenario(options)
    config = _start_settings(options, scenario).config
    return run_self_test_command(options, lambda: _opened(config, scenario))


def _focus(options: argparse.Namespace) -> int:
    from device.assembly.probe import open_focusing
    from device.commands.focus import run_focus_command

    scenario = _scenario(options)
    config = _start_settings(options, scenario).config
    return run_focus_command(options, config, lambda: open_focusing(config, scenario))


def _record(options: argparse.Namespace) -> int:
    """Record one press on a phantom or a grid: it is what a virtual probe is pressed on, whatever its scene says."""
    from device.assembly.probe import open_phantom_press
    from device.commands.record import run_record_command

    scenario = _scenario(options)
    settings = _start_settings(options, scenario)
    if settings.warning:
        print(f"{settings.warning.code} {settings.warning}", file=sys.stderr)

    def opened(phantom: PhantomTruth) -> PhantomPress:
        pressed = scenario and scenario.on(
            phantom.inclusion, is_grid=phantom.is_grid, tissue_kpa_mm=phantom.tissue_kpa_mm
        )
        return open_phantom_press(settings.config, pressed)

    return run_record_command(options, opened)


if __name__ == "__main__":
    faulthandler.enable()  # the watchdog's SIGABRT then writes where every thread was
    sys.exit(main())
