"""Settings files to the settings that a start uses: their own, or, when they are bad, those of the last good start.

What is kept is what the files set, not the defaults, which may name folders of a release that is gone. It lies in the
data folder, as far as the bad files can still say which one that is.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from pathlib import Path

from device.config import Config
from device.errors import LastGoodConfigError
from device.files.durable import write_durably
from device.files.plain_settings import LAST_GOOD, ROOT, below, is_there
from device.files.toml_record import UnknownKey
from device.settings.catalogue import SETTINGS
from device.settings.layers import Layers, read_layers

log = logging.getLogger(__name__)

HEADER = "# What the settings files set when this probe last started with all of them good. Written by the daemon.\n"


@dataclass(frozen=True)
class StartSettings:
    """The configuration of a start, the warning that it is not that of the files, and the files if they are good."""

    config: Config
    warning: LastGoodConfigError | None = None
    layers: Layers | None = None

    def keep(self) -> None:
        """Write what good files set durably, for a start with bad ones; call it when the start has succeeded."""
        if self.layers is None:
            return
        path, content = self.config.data / LAST_GOOD, _written(self.layers).encode()
        try:
            if not path.exists() or path.read_bytes() != content:
                write_durably(path, content)
        except OSError as error:
            log.warning("The last good settings cannot be kept in %s: %s.", path, error.strerror)


def start_settings(layers: Layers, root: Path = ROOT) -> StartSettings:
    """Return the settings of these files, or the last good ones below the same root with a warning.

    A last good setting that only a newer release knows is passed over, so that an older one can come back. Raises
    `ConfigError` with every problem of the files, and of the last good settings, when neither can be used.
    """
    for told in layers.renamed:
        log.warning("%s", told)
    if not layers.problems:
        return StartSettings(layers.config(), layers=layers)
    path = below(root, Path(layers.values.get("data", SETTINGS["data"].default))) / LAST_GOOD
    last = read_layers([path] if is_there(path) else [])
    wrong = [problem for problem in last.problems if not isinstance(problem.what, UnknownKey)]
    if not last.files or wrong:
        raise layers.refusal(*wrong)
    for problem in layers.problems:
        log.error("%s", problem)
    for told in (*last.renamed, *(f"passed over: {problem}" for problem in last.problems)):
        log.warning("%s", told)
    warning = _warning(layers, path)
    log.warning("%s %s", warning.code, warning)
    return StartSettings(replace(last, problems=()).config(), warning)


def _warning(layers: Layers, path: Path) -> LastGoodConfigError:
    first, *others = layers.problems
    more = f" and {len(others)} more" if others else ""
    return LastGoodConfigError(
        f"The settings files are bad ({first.what.quantity} in {first.file}{more}); "
        f"this probe runs on its last good settings, {path}.",
        "See `python -m device config check`, correct the files and start the daemon again.",
    )


def _written(layers: Layers) -> str:
    """Return what the files set as one TOML file, the settings above all sections first."""
    config = layers.config()
    lines, section = [HEADER], ""
    for known in (SETTINGS[name] for name in SETTINGS if name in layers.origins):
        if known.section != section:
            section = known.section
            lines.append(f"[{section}]\n")
        lines.append(f"{known.name.rpartition('.')[2]} = {known.written(known.value(config))}\n")
    return "".join(lines)
