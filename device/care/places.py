"""Where a probe keeps what is its own: its settings, its data folder, certificates and models that no release brings.

`root` stands for /, as when the card of a dead probe is mounted somewhere: every absolute path lies below it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from device.config import Config
from device.files.plain_settings import DROP_INS, LOCAL
from device.files.shipped import MODELS
from device.records.database import DATABASE
from device.records.saved import SAME_DISK, SAVED

RELEASES = Path("/opt/tsis")
MODEL_SETTINGS = ("paper_model", "quick_model", "standard_model")
PASSING = {"lock", "restart.json", "answer_times.json", SAVED, SAME_DISK}
"""Files of the data folder that belong to the daemon that runs."""
KEYS = "tls"
"""The folder of the server's own certificate: a key is no part of a backup, and a new card gets a new one."""


@dataclass(frozen=True)
class Places:
    """Paths as the settings state them, before any root.

    `calibration` is None when the certificates lie in the data folder or are the release's own; `models` are the
    folders outside both, by their settings.
    """

    data: Path
    calibration: Path | None
    models: dict[str, Path]

    @classmethod
    def of(cls, config: Config) -> Places:
        """Return the places of these settings."""
        data = config.data
        own = {name: path for name in MODEL_SETTINGS if _is_own(path := getattr(config, name), data)}
        return cls(data, config.calibration if _is_own(config.calibration, data) else None, own)

    def as_record(self) -> dict[str, object]:
        """Return them as JSON object."""
        models = {name: str(path) for name, path in self.models.items()}
        return {
            "data": str(self.data),
            "calibration": str(self.calibration) if self.calibration else None,
            "models": models,
        }


def settings_files(root: Path) -> Iterator[tuple[str, Path]]:
    """Yield the settings files that are the probe's own, each with its name in a backup."""
    for name in (LOCAL, DROP_INS):
        path = root / name
        for file in sorted(path.glob("*.toml")) if path.is_dir() else [path]:
            if file.is_file() and not file.is_symlink() and not file.name.startswith("."):
                yield f"settings/{file.relative_to(root / LOCAL.rpartition('/')[0]).as_posix()}", file


def data_files(folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield the files of a data folder by their names in it, but for the database and what is under way."""
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        is_passing = (
            any(part.endswith(".tmp") for part in name.parts) or name.as_posix() in PASSING or name.parts[0] == KEYS
        )
        is_database = len(name.parts) == 1 and name.name.startswith(DATABASE)
        if path.is_file() and not path.is_symlink() and not is_passing and not is_database:
            yield name.as_posix(), path


def links(folder: Path) -> list[str]:
    """Return the links in a folder: they lead elsewhere, and are not followed."""
    return [path.relative_to(folder).as_posix() for path in sorted(folder.rglob("*")) if path.is_symlink()]


def _is_own(path: Path, data: Path) -> bool:
    return not any(path.is_relative_to(other) for other in (data, MODELS, RELEASES))
