"""A folder of model.json, its hash, model.onnx and what a mode adds to the model that has proved itself.

The only place that reads bundles from a disk. What their contents must be: device/measurement/bundle.py, and each
mode's model. Source of the format: docs/contracts.md.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from device.measurement.bundle import CARD_FILE, CARD_HASH_FILE, MODEL_FILE, BundleFiles, BundleRefused, ModelBundle
from device.measurement.mode_models import ModeModels
from device.measurement.paper_mode.estimate import PAPER_UNITS
from device.measurement.quantities import InvalidQuantity
from device.measurement.quick_mode.model import QUICK_UNITS, QuickModel
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.commissioned.own_probe import OWN_ARRAYS
from device.measurement.ramp_modes.model import RAMP_UNITS, SURROGATE_ARRAYS, SURROGATE_FILE, RampModel, ramp_answers_of
from device.measurement.ramp_modes.range_classifier import RANGE_FILE, RangeClassifier

Arrays = Mapping[str, NDArray[Any]]
ModeModel = TypeVar("ModeModel", QuickModel, RampModel)
DAMAGED = (EOFError, KeyError, ValueError, BadZipFile, OSError)
"""What NumPy raises for an archive that is damaged or lacks an array."""


def read_paper_model(folder: Path) -> ModelBundle:
    """Return the bundle of mode paper; raises `BundleRefused` when anything in it is missing or does not hold."""
    return ModelBundle(_files(folder), PAPER_UNITS)


def read_quick_model(folder: Path) -> QuickModel:
    """Return the model of mode quick; raises `BundleRefused` as `read_paper_model`."""
    return QuickModel(ModelBundle(_files(folder), QUICK_UNITS))


def read_ramp_model(folder: Path) -> RampModel:
    """Return the model of modes standard and precise; raises `BundleRefused` or `InvalidQuantity` as the others."""
    files = _files(folder, SURROGATE_FILE, RANGE_FILE)
    bundle = ModelBundle(files, RAMP_UNITS)
    content = files.verified(SURROGATE_FILE, bundle.card.get("surrogate_sha256"))
    answers = ramp_answers_of(_arrays("surrogate", folder / SURROGATE_FILE, content, SURROGATE_ARRAYS, OWN_ARRAYS))
    return RampModel(bundle, answers, RangeClassifier(files, bundle.fields, len(RAMP_UNITS)))


def read_range_classifier(folder: Path, file: str, entry: str) -> RangeClassifier:
    """Return networks of a ramp bundle that tell its ranges, by file and card entry; raises `BundleRefused`."""
    files = _files(folder, file)
    return RangeClassifier(files, ModelBundle(files, RAMP_UNITS).fields, len(RAMP_UNITS), file, entry)


def read_models(paper: ModelBundle, quick: Path, standard: Path) -> ModeModels:
    """Return the bundle of mode paper with the models of two folders, which may be missing.

    Raises `BundleRefused` or `InvalidQuantity` when one that is there does not hold.
    """
    return ModeModels(paper, _if_there(quick, read_quick_model), _if_there(standard, read_ramp_model))


def read_ramp_answers(path: Path) -> RampAnswers:
    """Read forward model and noise alone; raise `InvalidQuantity` when a part is missing or of another shape."""
    content = _content("surrogate", path, SURROGATE_ARRAYS)
    return ramp_answers_of(_arrays("surrogate", path, content, SURROGATE_ARRAYS, OWN_ARRAYS))


def _files(folder: Path, *more: str) -> BundleFiles:
    """Return card, network and those of `more` files that are there; raises `BundleRefused` for one it cannot read.

    A file that is missing is refused by what needs it: then the card has been read, and may be of an earlier version.
    """
    names = (CARD_FILE, MODEL_FILE, *(name for name in (CARD_HASH_FILE, *more) if (folder / name).exists()))
    return BundleFiles(folder, {name: _bundle_content(folder, name) for name in names})


def _bundle_content(folder: Path, name: str) -> bytes:
    try:
        return (folder / name).read_bytes()
    except OSError as error:
        raise BundleRefused(folder, name, f"unreadable ({error.strerror})", "a readable file") from error


def _content(what: str, path: Path, names: tuple[str, ...]) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise _not_an_archive(what, path, names) from error


def _arrays(what: str, path: Path, content: bytes, names: tuple[str, ...], more: tuple[str, ...] = ()) -> Arrays:
    """Return the arrays of these names, and `more` where they are there."""
    try:
        with np.load(io.BytesIO(content)) as file:
            return {name: np.asarray(file[name]) for name in (*names, *(one for one in more if one in file))}
    except DAMAGED as error:
        raise _not_an_archive(what, path, names) from error


def _not_an_archive(what: str, path: Path, names: tuple[str, ...]) -> InvalidQuantity:
    return InvalidQuantity(what, path, f"a .npz with {', '.join(names)}", "install the model bundle again")


def _if_there(folder: Path, read: Callable[[Path], ModeModel]) -> ModeModel | None:
    return read(folder) if folder.exists() else None
