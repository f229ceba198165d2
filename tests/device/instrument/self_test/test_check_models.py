"""Every installed bundle is read again and computes its golden vectors; one that does not hold is named."""

import shutil
from dataclasses import replace

import pytest
from daemon_process import ROOT

from device.config import simulated_config
from device.instrument.self_test.checks import model_results


@pytest.fixture
def config(tmp_path):
    shutil.copytree(ROOT / "models" / "paper", tmp_path / "paper")
    shutil.copytree(ROOT / "models" / "standard", tmp_path / "standard")
    folders = {
        "paper_model": tmp_path / "paper",
        "quick_model": tmp_path / "quick",
        "standard_model": tmp_path / "standard",
    }
    return replace(simulated_config(), **folders)


def verdicts(results):
    return {result.check: result.verdict for result in results}


def test_installed_models_pass_with_their_deviation_and_a_missing_one_is_not_tested(config):
    results = model_results(config, lambda folder: folder)
    assert verdicts(results) == {"model paper": "passed", "model quick": "not_tested", "model standard": "passed"}
    assert 0.0 <= results[0].value < 1e-4


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("paper", "model.onnx"),
        ("paper", "model.json"),
        ("standard", "surrogate.npz"),
        ("standard", "range.onnx"),
    ],
)
def test_a_model_with_a_changed_file_fails_and_the_others_do_not(config, tmp_path, name, file):
    with (tmp_path / name / file).open("ab") as changed:
        changed.write(b"!")
    results = model_results(config, lambda folder: folder)
    assert [check for check, verdict in verdicts(results).items() if verdict == "failed"] == [f"model {name}"]
    [failed] = [result for result in results if result.verdict == "failed"]
    assert (failed.part, failed.code) == ("Model", "E401")
    assert file in failed.cause


def test_a_model_is_read_where_it_is_said_to_lie(config, tmp_path):
    results = model_results(config, lambda folder: tmp_path / "elsewhere" / folder.name)
    assert set(verdicts(results).values()) == {"not_tested"}
