"""The committed networks of the ranges: what they say of presses, and that a damaged file is refused."""

import hashlib
import json
import pickle
import shutil
from dataclasses import replace

import numpy as np
import pytest
from daemon_process import ROOT
from model_card import write_card
from onnx import TensorProto, helper, numpy_helper

from device.files.bundle_file import read_ramp_model
from device.measurement.bundle import BundleRefused
from device.measurement.mode_models import ModeModels
from device.measurement.parameters import PARAMETERS
from device.measurement.ramp_modes.model import RAMP_MODES
from device.measurement.ramp_modes.radial_profile import NETWORK_NAMES
from device.measurement.ramp_modes.range_classifier import OUTPUT, RANGE_FILE


@pytest.fixture
def folder(tmp_path):
    return shutil.copytree(ROOT / "models" / "standard", tmp_path / "standard")


def card_of(folder):
    return json.loads((folder / "model.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("mode", RAMP_MODES)
def test_an_inclusion_in_the_middle_of_the_ranges_lies_inside(ramp_model, mode):
    rows = ramp_model.answers.surrogate.rows(np.zeros((1, len(PARAMETERS))))
    assert ramp_model.ranges.log_odds(rows)[0] < min(0.0, ramp_model.critical[mode].outside_log_odds)


def test_an_inclusion_is_the_likelier_outside_the_larger_it_is(ramp_model):
    """Stiff and shallow ones, of 8.5, 13 and 15 mm."""
    normalised = np.zeros((3, len(PARAMETERS)))
    normalised[:, 0], normalised[:, 1], normalised[:, 2] = (0.0, 0.7, 1.0), -0.5, 0.5
    odds = ramp_model.ranges.log_odds(ramp_model.answers.surrogate.rows(normalised))
    assert odds[0] < odds[1] < odds[2]


def test_it_goes_to_another_process_whole(ramp_model):
    again = pickle.loads(pickle.dumps(ramp_model.ranges))
    rows = ramp_model.answers.surrogate.rows(np.random.default_rng(1).uniform(-1, 1, (5, len(PARAMETERS))))
    np.testing.assert_array_equal(again.log_odds(rows), ramp_model.ranges.log_odds(rows))


def test_a_missing_file_is_refused(folder):
    (folder / RANGE_FILE).unlink()
    with pytest.raises(BundleRefused, match=r"range.onnx is missing, but must be in the bundle's folder"):
        read_ramp_model(folder)


def test_a_changed_bit_is_refused(folder):
    content = bytearray((folder / RANGE_FILE).read_bytes())
    content[len(content) // 2] ^= 1
    (folder / RANGE_FILE).write_bytes(content)
    with pytest.raises(BundleRefused, match=r"range.onnx is [0-9a-f]{64}, but must be [0-9a-f]{64} as model.json"):
        read_ramp_model(folder)


def test_a_card_without_the_entry_is_refused(folder):
    card = card_of(folder)
    del card["range"]
    write_card(folder, json.dumps(card))
    with pytest.raises(BundleRefused, match="range is missing"):
        read_ramp_model(folder)


@pytest.mark.parametrize(
    ("golden", "words"),
    [
        ({"standard": [0.0] * 8}, r"\.standard is off by .*, but must be reproduced within 0\.0001"),
        ({"standard": [0.0] * 3}, r"\.standard is 3 rows, but must be 8 rows"),
        ({"precise": [0.0] * 8}, r"\.standard is missing"),
        ({"standard": "none"}, r"\.standard is 'none'"),
        ([], r"\.standard is missing"),
    ],
)
def test_golden_log_odds_that_it_does_not_give_are_refused(folder, golden, words):
    card = card_of(folder)
    card["range"]["golden"] = golden
    write_card(folder, json.dumps(card))
    with pytest.raises(BundleRefused, match=rf"range\.golden{words}"):
        read_ramp_model(folder)


def network(outputs: tuple[str, ...], *, rows: str | int = "n", columns: int = 1) -> bytes:
    """Return a network whose log odds are the first of its features."""
    features = len(NETWORK_NAMES)
    first = numpy_helper.from_array(np.eye(features, columns, dtype=np.float32), "first")
    nodes = [helper.make_node("MatMul", ["features", "first"], [name]) for name in outputs]
    ports = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [rows, columns]) for name in outputs]
    taken = helper.make_tensor_value_info("features", TensorProto.FLOAT, [rows, features])
    graph = helper.make_graph(nodes, "ranges", [taken], ports, [first])
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8).SerializeToString()


@pytest.mark.parametrize(
    "other", [network(("precise",)), network((OUTPUT,), rows=8), network((OUTPUT,), columns=3), network(("a", "b"))]
)
def test_a_network_of_other_outputs_or_of_so_many_rows_is_refused(folder, other):
    """Hash and golden log odds are right: what is wrong would show with the first press."""
    card = card_of(folder)
    first = [row[0] for row in card["golden"]["features"]]
    card["range"] |= {"sha256": hashlib.sha256(other).hexdigest(), "golden": {OUTPUT: first}}
    (folder / RANGE_FILE).write_bytes(other)
    write_card(folder, json.dumps(card))
    with pytest.raises(BundleRefused, match=r"(in|out)puts of range\.onnx"):
        read_ramp_model(folder)


def test_it_is_proved_again_with_the_other_models(folder, bundle):
    ramp = read_ramp_model(folder)
    models = ModeModels(bundle, ramp=ramp)
    models.prove()
    golden = ramp.ranges._golden
    ramp.ranges._golden = replace(golden, outputs={OUTPUT: np.zeros((8, 1))})
    with pytest.raises(BundleRefused, match=r"range\.golden\.standard is off by"):
        models.prove()
