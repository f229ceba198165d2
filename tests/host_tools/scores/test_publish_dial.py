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
