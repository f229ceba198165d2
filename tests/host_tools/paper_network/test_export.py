"""The bundle: same numbers as NumPy, same bytes for the same training, all of it or nothing."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnxruntime
import pytest

from device.files.bundle_file import read_paper_model
from device.measurement.quantities import InvalidQuantity
from host_tools.paper_network import export as exporting
from host_tools.paper_network.export import build_network, export
from host_tools.paper_network.export_refused import ExportRefused
from host_tools.paper_network.network import Ensemble
from host_tools.paper_network.train import Trained


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_the_exported_network_computes_what_numpy_does(untrained: Trained) -> None:
    """Everything between the float32 ends is float64, so only their rounding of 6e-8 may show; also below the floor."""
    features = np.float32(
        np.vstack([untrained.rows.features, np.zeros((1, 3)), -np.ones((1, 3)), np.full((1, 3), 1e6)])
    )
    session = onnxruntime.InferenceSession(build_network(untrained.ensemble), providers=["CPUExecutionProvider"])
    found = session.run(["estimate", "spread"], {"features": features})
    for theirs, ours in zip(found, untrained.ensemble.estimate(features.astype(float)), strict=True):
        assert theirs.dtype == np.float32
        assert theirs == pytest.approx(ours, rel=2e-7)


def test_the_device_accepts_the_bundle_and_its_card_tells_the_training(untrained: Trained, tmp_path: Path) -> None:
    folder = tmp_path / "models" / "demo"
    export(untrained, folder, software_version="1.2.3")
    card = read_paper_model(folder).card
    assert (card["name"], card["software_version"]) == ("demo", "1.2.3")
    assert (card["trials"], card["seed"], card["training_rows"], card["excluded_rows"]) == (3, 1, 125, 2)
    assert card["sha256"] == hashlib.sha256((folder / "model.onnx").read_bytes()).hexdigest()
    assert card["dataset_sha256"] == "ab" * 32
    assert card["scene_defaults"] == {"force_n": 1.0}
    assert card["held_out_errors_percent"]["phantoms"] == 9
    assert set(card["held_out_errors_percent"]["depth_mm"]) == {"mean", "SD", "min", "max"}
    assert len(card["golden"]["features"]) >= 5
    assert card["training_command"] == "python -m host_tools train --trials 3 --seed 1"


def test_training_ranges_leave_out_phantoms_and_start_at_the_floor(untrained: Trained, tmp_path: Path) -> None:
    features, truth = untrained.rows.features.copy(), untrained.rows.truth.copy()
    features[0, 0], features[-1, 0], truth[-1, 0] = 1e-9, 1e3, 99.0  # the last row is a phantom
    export(
        replace(untrained, rows=replace(untrained.rows, features=features, truth=truth)),
        tmp_path / "m",
        software_version="1",
    )
    bundle = read_paper_model(tmp_path / "m")
    assert bundle.feature_range["max_deformation_mm"] == (1e-4, features[:-9, 0].max())
    assert bundle.box["size_mm"] == (truth[:-9, 0].min(), truth[:-9, 0].max())


def test_the_same_training_gives_the_same_bytes(untrained: Trained, tmp_path: Path) -> None:
    for place in ("a", "b"):
        export(untrained, tmp_path / place / "demo", software_version="1")
    assert contents(tmp_path / "a" / "demo") == contents(tmp_path / "b" / "demo")


def test_a_new_bundle_replaces_the_old_one_and_leaves_nothing_else(untrained: Trained, tmp_path: Path) -> None:
    export(untrained, tmp_path / "demo", software_version="1")
    (tmp_path / "demo" / "stray.onnx").touch()
    export(untrained, tmp_path / "demo", software_version="2")
    assert read_paper_model(tmp_path / "demo").card["software_version"] == "2"
    assert set(contents(tmp_path / "demo")) == {"model.onnx", "model.json", "model.json.sha256"}
    assert [path.name for path in tmp_path.iterdir()] == ["demo"]


@pytest.mark.parametrize("own", ["notes.txt", "sweep/rows.nc", "model.json/of/another", "demo"])
def test_what_is_no_bundle_is_refused_and_stays(untrained: Trained, tmp_path: Path, own: str) -> None:
    (tmp_path / own).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / own).write_text("mine")
    folder = tmp_path / "demo" if own == "demo" else tmp_path
    with pytest.raises(InvalidQuantity, match="must be a new folder or a model bundle: name another one"):
        export(untrained, folder, software_version="1")
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [tmp_path / own]


@pytest.mark.parametrize("own", ["recordings", "notes.txt", "own_probe.md"])
def test_a_bundle_with_something_of_ones_own_in_it_is_not_replaced(
    untrained: Trained, tmp_path: Path, own: str
) -> None:
    export(untrained, tmp_path / "demo", software_version="1")
    (tmp_path / "demo" / own).mkdir()
    with pytest.raises(InvalidQuantity, match="a new folder or a model bundle"):
        export(untrained, tmp_path / "demo", software_version="2")
    assert read_paper_model(tmp_path / "demo").card["software_version"] == "1"


def test_an_empty_folder_becomes_the_bundle(untrained: Trained, tmp_path: Path) -> None:
    (tmp_path / "demo").mkdir()
    export(untrained, tmp_path / "demo", software_version="1")
    assert read_paper_model(tmp_path / "demo").card["name"] == "demo"


def test_a_network_that_differs_from_numpy_is_refused_and_nothing_is_written(
    untrained: Trained, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An output bias off by 1e-3 of half the box moves sizes of some 7.5 mm by 7.5 um: 1e-3, over the 1e-5 allowed."""
    parameters = untrained.ensemble.parameters.copy()
    parameters[:, -3] += 1e-3
    wrong = build_network(Ensemble(untrained.ensemble.scaling, parameters))
    monkeypatch.setattr(exporting, "build_network", lambda ensemble: wrong)
    with pytest.raises(ExportRefused, match=r"estimate of the exported network differs from NumPy by .* within 1e-05"):
        export(untrained, tmp_path / "demo", software_version="1")
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_leaves_the_old_bundle_whole(
    untrained: Trained, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    export(untrained, tmp_path / "demo", software_version="1")
    before = contents(tmp_path / "demo")

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        export(untrained, tmp_path / "demo", software_version="2")
    assert contents(tmp_path / "demo") == before
    assert [path.name for path in tmp_path.iterdir()] == ["demo"]


def test_the_card_is_strict_json(untrained: Trained, tmp_path: Path) -> None:
    export(untrained, tmp_path / "demo", software_version="1")
    text = (tmp_path / "demo" / "model.json").read_text()
    assert "NaN" not in text
    assert json.loads(text)["schema"] == "tsis.model/1"
