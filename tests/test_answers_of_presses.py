"""The comparison of answers before and after a change: what has not moved is said to be so, what has is not."""

import copy
import json
from functools import partial

import answers_of_presses as script
import numpy as np
import pytest

from device.files.bundle_file import read_ramp_model
from device.files.shipped import MODELS

COUNT = 1


@pytest.fixture(scope="module")
def model():
    return read_ramp_model(MODELS / "standard")


@pytest.fixture(scope="module")
def answers(model):
    return script.answers(model, COUNT)


@pytest.fixture
def main(monkeypatch, answers):
    monkeypatch.setattr(script, "answers", lambda model: answers)
    return script.main


def test_the_same_presses_have_the_same_answers_and_others_others(model, answers):
    again = script.answers(model, COUNT)
    assert all(ratios.max() == 0.0 for ratios in script.moved(answers, again).values())
    assert {mode: len(of_mode) for mode, of_mode in answers.items()} == {"standard": COUNT, "precise": COUNT}
    means = np.array([one["mean"] for of_mode in answers.values() for one in of_mode])
    assert len(np.unique(means[:, 0])) == 2 * COUNT


@pytest.mark.parametrize(("by", "code"), [(0.005, 0), (0.02, 1)])
def test_what_moved_by_more_than_a_hundredth_of_its_spread_fails(main, answers, tmp_path, capsys, by, code):
    before = copy.deepcopy(answers)
    one = before["precise"][0]
    one["mean"][2] += by * one["spread"][2]
    (tmp_path / "before.json").write_text(json.dumps(before))
    assert main(["--compare", str(tmp_path / "before.json")]) == code
    standard, precise = capsys.readouterr().out.splitlines()
    assert standard == f"standard  {COUNT} presses: largest 0, 95 % 0, RMS 0 spreads"
    assert f"largest {by:.2g}," in precise


def test_other_samples_of_the_same_posteriors_move_answers(model, answers, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(script.posterior, "SEED", script.posterior.SEED)
    monkeypatch.setattr(script, "read_ramp_model", lambda folder: model)
    monkeypatch.setattr(script, "answers", partial(script.answers, count=COUNT))
    before = tmp_path / "before.json"
    before.write_text(json.dumps(answers))
    assert script.main(["--compare", str(before)]) == 0
    assert "largest 0," in capsys.readouterr().out
    assert script.main(["--sampler-seed", "7", "--compare", str(before)]) == 0
    assert "largest 0," not in capsys.readouterr().out
    with pytest.raises(SystemExit):
        script.main(["--sampler-seed", "7"])


def test_what_is_written_can_be_compared(main, tmp_path):
    assert main(["--json", str(tmp_path / "now.json")]) == 0
    assert main(["--compare", str(tmp_path / "now.json")]) == 0


def test_answers_to_other_presses_are_not_compared(main, answers, tmp_path, capsys):
    before = copy.deepcopy(answers)
    before["standard"][0]["rows"] *= 1.01
    (tmp_path / "before.json").write_text(json.dumps(before))
    assert main(["--compare", str(tmp_path / "before.json")]) == 1
    assert "not the same presses" in capsys.readouterr().err
