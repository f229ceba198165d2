"""What a maintainer needs to know of a probe, section by section, as JSON values without patients' data.

Each section is collected by itself, and may raise what it likes: `device.care.support` notes why it is missing. So
nothing of ours but `known_words` is imported before a section needs it. Of measurements there are counts alone; of
settings numbers and choices, of a free text only whether it is set; of the log and of every sentence the known words.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import os
import platform
import re
import shutil
import sqlite3
import subprocess
import sys
import urllib.request
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from device import __version__
from device.care.known_words import HELD_BACK, known_in, known_only

UPDATES = "var/lib/tsis-update"
DATA, PORT = "var/lib/tsis", 8000
"""Where they are unless settings that can be read say otherwise."""
LIBRARIES = ("numpy", "opencv-contrib-python-headless", "onnxruntime", "smbus2", "pyserial", "fastapi", "pydantic")
SERVICES = ("tsis", "tsis-boot", "tsis-update", "tsis-kiosk", "tsis-fallback")
STATES = ("LoadState", "ActiveState", "SubState", "Result", "NRestarts", "ExecMainStatus")
MODEL_FILES = ("model.json", "model.onnx", "surrogate.npz", "range.onnx")
SECRET = re.compile("token|password|passphrase|secret|credential|private|key", re.IGNORECASE)
SERIAL = re.compile(r"[A-Z]{2,6}-\d{1,8}|SIM-LINEAR")
CODE = re.compile(r"E\d{3}")
PLAIN = re.compile(r"[a-z0-9_-]{0,40}")
DAY = re.compile(r"\d{4}-\d\d-\d\dT[\d:.]+Z?")
LOG_LINES, LOG_BYTES = 3000, 4 << 20
ASK_S = 3.0
RUN_S = 15.0


@dataclass(frozen=True)
class SupportContext:
    """Which probe it is of: the machine below `root`, with the settings file `stated` if any, or a simulated one."""

    root: Path = Path("/")
    stated: Path | None = None
    is_simulated: bool = False

    @cached_property
    def config(self) -> Any:
        """The settings with which a start would begin; raises what that would."""
        from device.config import simulated_config
        from device.files.plain_settings import layer_files
        from device.settings.last_good import start_settings
        from device.settings.layers import read_layers

        if self.is_simulated and not self.stated:
            return simulated_config()
        return start_settings(read_layers(layer_files(self.root, self.stated)), self.root).config

    @property
    def data(self) -> Path:
        """The data folder, or where it is by default when no settings can be read."""
        try:
            from device.files.plain_settings import below

            return below(self.root, self.config.data)
        except Exception:  # noqa: BLE001 - the section of the settings says why
            return self.root / DATA

    @property
    def port(self) -> int:
        """The daemon's port, or the default one."""
        try:
            return int(self.config.server.port)
        except Exception:  # noqa: BLE001 - the section of the settings says why
            return PORT


def versions(context: SupportContext) -> dict[str, Any]:
    """Return what runs: our version, Python, kernel, board, libraries."""
    found: dict[str, Any] = {}
    for name in LIBRARIES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = None
    return {
        "software": __version__,
        "python": platform.python_version(),
        "machine": platform.machine(),
        "kernel": platform.release(),
        "system": _os_release(context.root / "etc/os-release"),
        "board": known_board(context.root / "proc/device-tree/model"),
        "libraries": found,
    }


def known_board(path: Path) -> str | None:
    """Return the name that a Raspberry Pi gives itself, None on another machine."""
    if not path.exists():
        return None
    text = path.read_text(encoding="ascii", errors="replace").strip("\0\n ")
    return text if re.fullmatch(r"Raspberry Pi [\w .]{1,40}", text) else HELD_BACK


def _os_release(path: Path) -> dict[str, str] | None:
    if not path.exists():
        return None
    fields = dict(line.split("=", 1) for line in path.read_text(encoding="utf-8").splitlines() if "=" in line)
    return {name: fields.get(name, "").strip('"') for name in ("ID", "VERSION_ID")}


def release(context: SupportContext) -> dict[str, Any]:
    """Return what the updater knows: the releases, the last update and its end."""
    folder = context.root / UPDATES
    found = {}
    for name in ("state", "progress"):
        path = folder / f"{name}.json"
        found[name] = known_in(json.loads(path.read_text(encoding="utf-8"))) if path.exists() else None
    return found


def settings(context: SupportContext) -> dict[str, Any]:
    """Return what the settings files set: numbers and choices, of texts only that they are set; and every problem."""
    from device.files.plain_settings import layer_files
    from device.settings.catalogue import SETTINGS
    from device.settings.layers import read_layers

    layers = read_layers(layer_files(context.root, context.stated))
    problems = [
        {
            "setting": one.what.quantity if one.what.quantity in SETTINGS else known_only(one.what.quantity),
            "bound": known_only(one.what.bound),
        }
        for one in layers.problems
    ]
    set_values = {name: _shown(SETTINGS[name], value) for name, value in layers.values.items()}
    kinds = Counter("drop-in" if path.parent.name == "config.d" else path.name for path in layers.files)
    found = {"files": dict(kinds), "problems": problems, "set": set_values, "in_use": None}
    try:
        config = context.config
    except Exception as error:  # noqa: BLE001 - neither the files nor the last good settings can be used
        return {**found, "why_none": f"{type(error).__name__}: {known_only(str(error))}"}
    return {**found, "in_use": {name: _shown(known, known.value(config)) for name, known in SETTINGS.items()}}


def _shown(known: Any, value: Any) -> Any:
    """Return a setting's value if it is a number, a choice or the serial number, else only whether it is set."""
    if SECRET.search(known.name):
        return "redacted"
    if known.name == "serial":
        return value if SERIAL.fullmatch(str(value)) else HELD_BACK
    if value is None or isinstance(value, bool | int | float):
        return value
    if isinstance(value, list | tuple):
        return [one if isinstance(one, int | float) else HELD_BACK for one in value]
    if str(value) in known.range.split(", "):
        return str(value)
    return "default" if str(value) == str(known.default) else "set"


def log(context: SupportContext) -> dict[str, Any]:
    """Return the newest lines of the log by their time, service and level, and of each the known words."""
    command = ["journalctl", "--no-pager", "--output=json", f"--lines={LOG_LINES}"]
    command += [f"--unit={name}" for name in SERVICES]
    if context.root != Path("/"):
        command.append(f"--root={context.root}")
    lines = _run(command)[-LOG_BYTES:].splitlines()
    return {"lines": list(_log_lines(lines))}


def _log_lines(lines: list[str]) -> Iterator[dict[str, Any]]:
    for line in lines:
        try:
            entry = json.loads(line)
            message = entry["MESSAGE"]
            time_us = int(entry["__REALTIME_TIMESTAMP"])
        except (ValueError, KeyError, TypeError):
            continue
        service = str(entry.get("_SYSTEMD_UNIT") or entry.get("UNIT") or "").removesuffix(".service")
        yield {
            "t_s": time_us / 1e6,
            "service": service if service in SERVICES else "systemd",
            "level": str(entry.get("PRIORITY", ""))[:1],
            "text": known_only(message) if isinstance(message, str) else HELD_BACK,
        }


def services(context: SupportContext) -> dict[str, Any]:
    """Return how systemd sees each service."""
    found = {}
    for name in SERVICES:
        text = _run(["systemctl", "show", f"{name}.service", f"--property={','.join(STATES)}"])
        pairs = (line.split("=", 1) for line in text.splitlines() if "=" in line)
        found[name] = {key: value for key, value in pairs if key in STATES and PLAIN.fullmatch(value)}
    return found


def daemon(context: SupportContext) -> dict[str, Any]:
    """Return what the daemon that runs says: its step, its faults, the health of its parts."""
    status = _asked(context, "status")
    return {
        "step": known_only(status["step"]),
        "press_state": known_only(status["press_state"]),
        "faults": [known_in({name: one[name] for name in FAULT_FIELDS}) for one in status["faults"]],
        "parts": known_in(_asked(context, "health/parts")),
    }


FAULT_FIELDS = ("code", "title", "severity", "cause", "remedy")
CHECK_FIELDS = ("part", "check", "verdict", "value", "unit", "bound", "code", "cause", "remedy")


def self_test(context: SupportContext) -> dict[str, Any]:
    """Return the last self-test of the daemon that runs."""
    report = _asked(context, "self-test")
    results = [known_in({name: one[name] for name in CHECK_FIELDS}) for one in report["results"]]
    facts = {name: report[name] for name in ("started_at", "state", "verdict", "on_block")}
    return {**known_in(facts), "results": results}


def storage(context: SupportContext) -> dict[str, Any]:
    """Return what the data folder holds, as counts, and how much room is left."""
    data = context.data
    room, flags = shutil.disk_usage(data), os.statvfs(data).f_flag
    recordings = data / "recordings"
    return {
        "total_mb": round(room.total / 1e6),
        "free_mb": round(room.free / 1e6),
        "is_read_only": bool(flags & os.ST_RDONLY),
        "recordings": sum(1 for _ in recordings.iterdir()) if recordings.is_dir() else 0,
        "last_good_settings": (data / "config.last_good.toml").exists(),
        "restart_note": (data / "restart.json").exists(),
    }


def measurements(context: SupportContext) -> dict[str, Any]:
    """Return how many measurements and presses there are, and how often each fault ended or marked one."""
    path = context.data / "tsis.sqlite"
    if not path.exists():
        raise FileNotFoundError("no database in the data folder")
    with closing(sqlite3.connect(f"file:{path.resolve().as_posix()}?mode=ro", uri=True, timeout=ASK_S)) as db:
        [verdict] = db.execute("PRAGMA quick_check(1)").fetchone()
        [schema] = db.execute("PRAGMA user_version").fetchone()
        [count] = db.execute("SELECT count(*) FROM measurement").fetchone()
        presses = [json.loads(row) for (row,) in db.execute("SELECT record FROM press")]
        lit_s = sum(row[0] for row in db.execute("SELECT value FROM counter WHERE name = 'light_on_s'"))
    warned = [one.get("code") for press in presses for one in press.get("warnings", ())]
    return {
        "is_whole": verdict == "ok",
        "schema": schema,
        "measurements": count,
        "presses_by_state": _counted((press.get("state") for press in presses), PLAIN),
        "presses_by_mode": _counted((press.get("mode") for press in presses), PLAIN),
        "presses_ended_by": _counted((press.get("code") for press in presses), CODE),
        "warnings": _counted(warned, CODE),
        "light_on_s": round(lit_s),
    }


def _counted(values: Any, allowed: re.Pattern[str]) -> dict[str, int]:
    """Return how often each value is there that is of an allowed form; a state is one of the program's own words."""
    texts = (str(value) for value in values if value is not None)
    return dict(Counter(one if allowed.fullmatch(one) and known_only(one) == one else HELD_BACK for one in texts))


def models(context: SupportContext) -> dict[str, Any]:
    """Return the hashes of models and certificates, and which certificate is active until when."""
    from device.care.places import MODEL_SETTINGS
    from device.files.plain_settings import below

    found: dict[str, Any] = {}
    for setting in MODEL_SETTINGS:
        folder = below(context.root, getattr(context.config, setting))
        found[setting] = {name: _sha256(folder / name) for name in MODEL_FILES if (folder / name).is_file()}
    path = below(context.root, context.config.calibration)
    files = [path] if path.is_file() else sorted(path.glob("*.json"))
    pointer = path / "active"
    active = pointer.read_text(encoding="utf-8").strip() if pointer.is_file() else None
    found["certificates"] = [_certificate(file, is_active=file.stem == active or file == path) for file in files]
    return found


def _certificate(file: Path, *, is_active: bool) -> dict[str, Any]:
    found: dict[str, Any] = {"sha256": _sha256(file), "is_active": is_active}
    try:
        record = json.loads(file.read_text(encoding="utf-8"))
        expires_at, serial = str(record["validity"]["expires_at"]), str(record["serial"])
    except (OSError, ValueError, KeyError, TypeError):
        return {**found, "is_readable": False}
    found["expires_at"] = expires_at if DAY.fullmatch(expires_at) else HELD_BACK
    found["serial"] = serial if SERIAL.fullmatch(serial) else HELD_BACK
    return found


def computer(context: SupportContext) -> dict[str, Any]:
    """Return supply, temperature, clock, memory, load and how long the computer has been on."""
    from device.hardware.computer import SysfsComputer

    state = SysfsComputer(lambda: context.root).read()
    memory = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines())
    return {
        "is_supply_low": state.is_supply_low,
        "temperature_c": state.temperature_c,
        "is_clock_set": state.is_clock_set,
        "up_s": float(Path("/proc/uptime").read_text(encoding="ascii").split()[0]),
        "load": os.getloadavg(),
        "memory_mb": {name: int(memory[name].split()[0]) // 1000 for name in ("MemTotal", "MemAvailable")},
        "processors": os.cpu_count(),
        "is_64_bit": sys.maxsize > 2**32,
    }


SECTIONS: dict[str, Callable[[SupportContext], dict[str, Any]]] = {
    "versions": versions,
    "release": release,
    "settings": settings,
    "services": services,
    "daemon": daemon,
    "self_test": self_test,
    "storage": storage,
    "measurements": measurements,
    "models": models,
    "computer": computer,
    "log": log,
}
"""Every section by the name of its file."""


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _run(command: list[str]) -> str:
    """Return what a command prints; raise `OSError` when it is not there or fails."""
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=RUN_S, check=False)
    if done.returncode != 0:
        raise OSError(f"{command[0]} failed with {done.returncode}")
    return done.stdout


def _asked(context: SupportContext, path: str) -> Any:
    """Return what the daemon of this machine answers; raise `OSError` when none does."""
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    with opener.open(f"http://127.0.0.1:{context.port}/api/v1/{path}", timeout=ASK_S) as answer:
        return json.loads(answer.read())
