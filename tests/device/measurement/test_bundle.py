"""The model bundle: what the device refuses, what it answers, and what it flags."""

from __future__ import annotations

import hashlib
import pickle
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from daemon_process import ROOT
from model_card import edit_card
from onnx import TensorProto, helper

from device.files.bundle_file import read_paper_model, read_quick_model, read_ramp_model
from device.measurement.bundle import BundleRefused
from device.measurement.feature_definitions import INCLUSION_FIELD_FEATURES
from device.measurement.paper_mode.estimate import PAPER_UNITS
from device.measurement.quantities import InvalidQuantity
from device.measurement.quick_mode.model import QUICK_UNITS
from device.measurement.quick_mode.profile import QUICK_NAMES
from device.measurement.ramp_modes.model import RAMP_UNITS
from host_tools.paper_network.export import export
from host_tools.paper_network.network import Ensemble, Scaling, initial_parameters
from host_tools.paper_network.train import Trained, TrainingRows

INSIDE = np.array([0.02, 0.8, 60.0])


@pytest.fixture
def trained() -> Trained:
    """Three random networks with scaling and ranges of 100 random rows."""
    rng = np.random.default_rng(2)
    features = rng.uniform((0.001, 0.05, 20.0), (0.1, 3.0, 90.0), (100, 3))
    truth = rng.uniform((1.0, 4.0, 40.0), (15.0, 12.0, 120.0), (100, 3))
    rows = TrainingRows(tuple(PAPER_UNITS), features, truth, np.arange(9), "00" * 32, {}, 0)
    parameters = np.array([initial_parameters(np.random.default_rng(trial)) for trial in range(3)])
    return Trained(Ensemble(Scaling.fit(features), parameters), rows, seed=1)


@pytest.fixture
def folder(trained: Trained, tmp_path: Path) -> Path:
    export(trained, tmp_path / "demo", software_version="1")
    return tmp_path / "demo"


def replace_network(folder: Path, network: bytes) -> None:
    (folder / "model.onnx").write_bytes(network)
    edit_card(folder, lambda card: card.update(sha256=hashlib.sha256(network).hexdigest()))


def network_with(input_name: str, columns: int) -> bytes:
    """A valid network that copies its input to estimate and spread."""
    names = (input_name, "estimate", "spread")
    ports = [helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", columns]) for name in names]
    nodes = [helper.make_node("Identity", [input_name], [name]) for name in names[1:]]
    graph = helper.make_graph(nodes, "copy", ports[:1], ports[1:])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    return bytes(model.SerializeToString())


def test_a_good_bundle_answers_as_the_ensemble_it_came_from(trained: Trained, folder: Path) -> None:
    """Inputs and outputs are float32, so the answers agree to a few times 6e-8."""
    bundle = read_paper_model(folder)
    rows = np.float32(trained.rows.features).astype(float)
    raw, expected = bundle.estimate(rows), trained.ensemble.estimate(rows)
    assert raw.estimate == pytest.approx(expected.estimate, rel=2e-7)
    assert raw.spread == pytest.approx(expected.spread, rel=2e-7)


def test_a_bundle_tells_its_name_hash_features_and_ranges(trained: Trained, folder: Path) -> None:
    bundle = read_paper_model(folder)
    assert bundle.name == "demo"
    assert bundle.sha256 == hashlib.sha256((folder / "model.onnx").read_bytes()).hexdigest()
    assert bundle.feature_names == ("max_deformation_mm", "central_deformation_mm3", "deformation_area_mm2")
    assert bundle.box["depth_mm"] == (trained.rows.truth[9:, 1].min(), trained.rows.truth[9:, 1].max())


@pytest.mark.parametrize("position", [0, 1000, -1])
def test_one_tampered_byte_is_refused(folder: Path, position: int) -> None:
    network = bytearray((folder / "model.onnx").read_bytes())
    network[position] ^= 1
    (folder / "model.onnx").write_bytes(network)
    with pytest.raises(BundleRefused, match=r"sha256 of model\.onnx is [0-9a-f]{64}, but must be [0-9a-f]{64}"):
        read_paper_model(folder)


def widened(card: dict[str, Any], group: str = "features") -> None:
    ranges = card["training_range"][group]
    ranges.update({name: [low - (high - low) / 2, high + (high - low) / 2] for name, (low, high) in ranges.items()})


@pytest.mark.parametrize(
    ("name", "read"), [("paper", read_paper_model), ("quick", read_quick_model), ("standard", read_ramp_model)]
)
def test_a_card_with_doubled_training_ranges_is_refused(
    tmp_path: Path, name: str, read: Callable[[Path], object]
) -> None:
    """All else in it holds: only its hash tells that it is not the one that was exported."""
    folder = shutil.copytree(ROOT / "models" / name, tmp_path / name)
    stated = (folder / "model.json.sha256").read_bytes()
    edit_card(folder, widened)
    read(folder)
    (folder / "model.json.sha256").write_bytes(stated)
    with pytest.raises(
        BundleRefused, match=r"sha256 of model\.json is [0-9a-f]{64}, but must be '[0-9a-f]{64}' as model"
    ):
        read(folder)


@pytest.mark.parametrize("group", ["unknowns", "nuisances"])
@pytest.mark.parametrize(("name", "read"), [("quick", read_quick_model), ("standard", read_ramp_model)])
def test_a_bundle_of_other_ranges_of_its_parameters_is_refused(
    tmp_path: Path, name: str, read: Callable[[Path], object], group: str
) -> None:
    """Its coordinates mean something else: a model of before the ranges grew would answer, and wrongly."""
    folder = shutil.copytree(ROOT / "models" / name, tmp_path / name)
    edit_card(folder, lambda card: widened(card, group))
    with pytest.raises(BundleRefused, match=rf"training_range\.{group}\.\w+ is .*: install models that this software"):
        read(folder)


@pytest.mark.parametrize("stated", [b"", b"no hash", b"\xff\xfe"])
def test_a_hash_that_is_none_is_refused(folder: Path, stated: bytes) -> None:
    (folder / "model.json.sha256").write_bytes(stated)
    with pytest.raises(BundleRefused, match=r"sha256 of model\.json"):
        read_paper_model(folder)


def test_a_bundle_without_the_hash_of_its_card_is_refused(folder: Path) -> None:
    (folder / "model.json.sha256").unlink()
    with pytest.raises(BundleRefused, match=r"model\.json\.sha256 is missing, but must be in the bundle's folder"):
        read_paper_model(folder)


@pytest.mark.parametrize("name", ["paper", "quick", "standard"])
def test_the_hash_of_a_card_is_what_sha256sum_checks(name: str) -> None:
    done = subprocess.run(
        ["sha256sum", "--check", "--strict", "model.json.sha256"], cwd=ROOT / "models" / name, check=False
    )
    assert done.returncode == 0


@pytest.mark.parametrize("file", ["model.onnx", "model.json"])
def test_a_missing_file_is_refused_by_name(folder: Path, file: str) -> None:
    (folder / file).unlink()
    with pytest.raises(BundleRefused, match=rf"^Model bundle \S+: {file} is unreadable \(No such file") as refusal:
        read_paper_model(folder)
    assert "Install the bundle again" in str(refusal.value)


@pytest.mark.parametrize("field", ["name", "sha256", "features", "training_range", "golden"])
def test_a_missing_field_is_refused_by_name(folder: Path, field: str) -> None:
    edit_card(folder, lambda card: card.pop(field))
    with pytest.raises(BundleRefused, match=rf"{field}\S* is missing"):
        read_paper_model(folder)


@pytest.mark.parametrize(
    ("features", "found"),
    [
        ([{"name": "volume_mm3", "unit": "mm3"}], "volume_mm3"),
        ([{"name": "max_deformation_mm", "unit": "um"}], r"\(um\)"),
        (["max_deformation_mm"], "max_deformation_mm"),
        ([], r"\[\]"),
        ([{"name": "max_deformation_mm", "unit": "mm"}] * 3, "max_deformation_mm"),
    ],
)
def test_features_the_probe_cannot_measure_are_refused(folder: Path, features: list[Any], found: str) -> None:
    edit_card(folder, lambda card: card.update(features=features))
    with pytest.raises(BundleRefused, match=f"features is .*{found}"):
        read_paper_model(folder)


@pytest.mark.parametrize("ratio", ["1", ""])
def test_a_card_may_leave_the_unit_of_a_ratio_empty_as_earlier_versions_did(tmp_path, ratio) -> None:
    folder = Path(shutil.copytree(ROOT / "models" / "quick", tmp_path / "quick"))
    edit_card(folder, lambda card: [f.update(unit=ratio) for f in card["features"] if f["name"] != "force_n"])
    assert read_quick_model(folder).bundle.feature_names == QUICK_NAMES


def test_another_unit_of_a_ratio_is_refused(tmp_path) -> None:
    folder = Path(shutil.copytree(ROOT / "models" / "quick", tmp_path / "quick"))
    edit_card(folder, lambda card: card["features"][0].update(unit="mm"))
    with pytest.raises(BundleRefused, match="features is"):
        read_quick_model(folder)


def test_a_bundle_of_another_mode_is_refused_with_the_features_that_are_read() -> None:
    with pytest.raises(BundleRefused, match=r"features is .*but must be max_deformation_mm \(mm\), central"):
        read_paper_model(ROOT / "models" / "quick")


def test_units_are_those_of_the_definitions() -> None:
    assert {name: definition.unit for name, definition in INCLUSION_FIELD_FEATURES.items()} == PAPER_UNITS
    assert set(RAMP_UNITS.values()) == {"1"}
    assert dict.fromkeys(QUICK_NAMES, "1") | {"force_n": "N"} == QUICK_UNITS


def test_features_outside_the_training_range_are_named_in_their_order() -> None:
    bundle = read_quick_model(ROOT / "models" / "quick").bundle
    row = np.array([np.mean(bundle.feature_range[name]) for name in QUICK_NAMES])
    low, high = bundle.feature_range[QUICK_NAMES[0]]
    row[0], row[-1] = high + 1, 0.7
    outside = bundle.outside_training_range(row)
    assert tuple(outside) == (QUICK_NAMES[0], "force_n")
    assert outside[QUICK_NAMES[0]] == (low, high)


@pytest.mark.parametrize("part", ["estimate", "spread"])
def test_a_golden_vector_that_is_not_reproduced_is_refused(folder: Path, part: str) -> None:
    """Off by 2e-4 relative, where 1e-4 is allowed."""

    def spoil(card: dict[str, Any]) -> None:
        card["golden"][part][2][1] *= 1.0002

    edit_card(folder, spoil)
    with pytest.raises(BundleRefused, match=rf"golden\.{part} is off by 0\.0002 relative"):
        read_paper_model(folder)


@pytest.mark.parametrize("golden", [[], [[1.0, 2.0]], [[1.0, 2.0, "x"]], [[1.0, 2.0, float("nan")]], [[1.0, 2.0, 3.0]]])
def test_a_golden_table_of_another_shape_is_refused(folder: Path, golden: list[Any]) -> None:
    edit_card(folder, lambda card: card["golden"].update(estimate=golden))
    with pytest.raises(BundleRefused, match=r"golden\.estimate is"):
        read_paper_model(folder)


def test_a_file_that_is_no_network_is_refused_though_its_hash_agrees(folder: Path) -> None:
    replace_network(folder, b"not a network")
    with pytest.raises(BundleRefused, match=r"model\.onnx is unusable"):
        read_paper_model(folder)


@pytest.mark.parametrize(("name", "columns", "side"), [("input", 3, "inputs"), ("features", 2, "inputs")])
def test_a_network_of_another_contract_is_refused(folder: Path, name: str, columns: int, side: str) -> None:
    replace_network(folder, network_with(name, columns))
    with pytest.raises(BundleRefused, match=rf"{side} of model\.onnx is .*'features', 'tensor\(float\)', 3"):
        read_paper_model(folder)


def test_a_network_that_computes_something_else_is_refused_by_its_golden_vectors(folder: Path) -> None:
    replace_network(folder, network_with("features", 3))
    with pytest.raises(BundleRefused, match=r"golden\.estimate is off by"):
        read_paper_model(folder)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e39])
def test_a_feature_that_is_not_finite_is_refused_by_name_and_row(folder: Path, value: float) -> None:
    """1e39 is finite in float64 and infinite in float32."""
    rows = np.tile(INSIDE, (3, 1))
    rows[1, 2] = value
    with pytest.raises(InvalidQuantity, match="deformation_area_mm2 of row 1 is"):
        read_paper_model(folder).estimate(rows)


@pytest.mark.parametrize("shape", [(3,), (1, 2), (1, 1, 3)])
def test_features_of_another_shape_are_refused(folder: Path, shape: tuple[int, ...]) -> None:
    with pytest.raises(InvalidQuantity, match=r"shape of features is .* but must be \[n, 3\] for max_deformation_mm"):
        read_paper_model(folder).estimate(np.ones(shape))


def test_no_rows_give_no_estimates(folder: Path) -> None:
    assert read_paper_model(folder).estimate(np.empty((0, 3))).estimate.shape == (0, 3)


def test_features_inside_the_training_range_are_not_flagged(folder: Path) -> None:
    assert read_paper_model(folder).outside_training_range(INSIDE) == {}


def test_each_feature_outside_the_training_range_is_named_with_its_range(folder: Path) -> None:
    bundle = read_paper_model(folder)
    outside = bundle.outside_training_range(np.array([0.5, 0.8, np.nan]))
    assert tuple(outside) == ("max_deformation_mm", "deformation_area_mm2")
    assert outside["max_deformation_mm"] == bundle.feature_range["max_deformation_mm"]


def test_a_bundle_answers_the_same_in_another_process(bundle):
    features = np.array(bundle.card["golden"]["features"])
    again = pickle.loads(pickle.dumps(bundle))
    np.testing.assert_array_equal(again.estimate(features).estimate, bundle.estimate(features).estimate)
