"""The model card says what its modes are worth and keeps all else it said."""

import json

import pytest

from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate, Quantity
from host_tools.scores import dial as mode_dial
from host_tools.scores.dial import publish_dial


@pytest.fixture
def folder(tmp_path):
    bundle = tmp_path / "bundle"
    bundle.mkdir()
    (bundle / "model.onnx").write_bytes(b"network")
    (bundle / "model.json").write_text(json.dumps({"name": "bundle", "modes": {"standard": {"misfit_ratio": 0.9}}}))
    return bundle


def test_the_card_states_frames_time_and_errors_of_the_same_presses(folder, tables, monkeypatch):
    """Two presses; the second is not answered, so the medians are the first one's own errors."""
    monkeypatch.setattr(mode_dial, "PRESSES", 2)
    answers = iter([Quantity(10.0, 9.0, 11.0, 0.5, True), UNKNOWN_QUANTITY])

    def answer(recording, mode):
        one = next(answers)
        return Estimate(one, one, one, "ok", "", mode, "m", "0", "c", True, features={})

    publish_dial(folder, ("standard",), answer, tables)
    card = json.loads((folder / "model.json").read_text())
    entry = card["modes"]["standard"]["dial"]
    assert (folder / "model.onnx").read_bytes() == b"network"
    assert card["name"] == "bundle"
    assert card["modes"]["standard"]["misfit_ratio"] == 0.9
    assert (entry["presses"], entry["answered"], entry["frames"]) == (2, 1, 10)
    assert set(entry["median_percent"]) == {"size_mm", "depth_mm", "youngs_modulus_kpa"}
    assert entry["determined"]["size_mm"] == 1.0
    assert entry["compute_ms"] >= 0
    assert "cores" in entry["machine"]


def test_a_scan_counts_the_frames_of_its_ramps(folder, tables, monkeypatch):
    monkeypatch.setattr(mode_dial, "PRESSES", 1)
    card = json.loads((folder / "model.json").read_text())
    (folder / "model.json").write_text(json.dumps(card | {"modes": {"precise": {}}}))
    quantity, asked = Quantity(10.0, 9.0, 11.0, 0.5, True), []

    def answer(recording, mode):
        asked.append(len(recording.ramps()))
        return Estimate(quantity, quantity, quantity, "ok", "", mode, "m", "0", "c", True, features={})

    publish_dial(folder, ("precise",), answer, tables)
    entry = json.loads((folder / "model.json").read_text())["modes"]["precise"]["dial"]
    assert asked == [2]
    assert entry["frames"] == 20
    assert entry["median_percent_of_all"] == entry["median_percent"]  # nothing was left unanswered
