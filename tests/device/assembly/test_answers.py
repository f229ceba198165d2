"""What a probe can answer: the modes whose model is there, and none other by default."""

from dataclasses import replace
from shutil import copytree

import numpy as np
import pytest
from model_card import edit_card

from device.assembly.answers import answers_for
from device.assembly.opened_parts import StartFailed
from device.assembly.probe import open_simulated_probe
from device.config import Config, PressSection, simulated_config
from device.errors import ForeignCalibration, ModelError
from device.files.bundle_file import read_models, read_paper_model
from device.files.shipped import MODELS
from device.measurement.bundle import BundleRefused
from device.measurement.mode import MODES
from device.measurement.paper_mode.estimate import estimate_paper
from device.measurement.parameters import NOMINAL
from device.measurement.quantities import InvalidQuantity
from device.simulation.scenario import Scenario
from host_tools.press_models.recorded_presses import recorded_press


def test_the_estimate_of_a_paper_press_is_that_of_its_model(bundle, calibration, recording):
    answers = answers_for(replace(simulated_config(), press=PressSection(mode="paper")), bundle, calibration)
    assert "paper" in answers.modes
    assert answers.estimator(recording, "paper") == estimate_paper(recording, bundle, calibration)


def test_the_simulated_probe_answers_in_every_mode_and_the_one_of_the_papers_light_in_that_only(bundle, calibration):
    assert answers_for(simulated_config(), bundle, calibration).modes == MODES
    assert answers_for(simulated_config("SIM-LINEAR"), bundle, calibration).modes == ("paper",)


def test_a_probe_without_their_models_has_the_papers_mode_only(bundle, calibration, tmp_path):
    config = replace(
        simulated_config("SIM-LINEAR"), serial="SIM-0001", standard_model=tmp_path / "a", quick_model=tmp_path / "b"
    )
    assert answers_for(config, bundle, calibration).modes == ("paper",)


def test_a_certificate_without_lines_answers_in_every_mode_but_the_papers(bundle, calibration, recording):
    without = replace(calibration, lines=None)
    answers = answers_for(simulated_config(), bundle, without)
    assert answers.modes == ("quick", "standard", "precise")
    assert set(answers.worth) == set(answers.modes)
    with pytest.raises(InvalidQuantity, match="without the lines of mode paper"):
        answers.estimator(recording, "paper")


def test_a_paper_model_of_another_press_costs_its_own_mode_and_no_other(calibration, recording, tmp_path, caplog):
    """A commissioned probe goes on pressing in the modes of its own models; one that has no other does not start."""
    copytree(MODELS / "paper", tmp_path / "paper")
    edit_card(tmp_path / "paper", lambda card: card["scene_defaults"]["press"].update(force_n=0.3))
    trained = read_paper_model(tmp_path / "paper")
    calibration = replace(calibration, lines=replace(calibration.paper_lines, model_card_sha256=trained.card_sha256))
    answers = answers_for(simulated_config(), trained, calibration)
    assert answers.modes == ("quick", "standard", "precise")
    assert "mode paper is not offered: calibration's force_n is 0.5 N, but must be 0.3 N within 6%" in caplog.text
    with pytest.raises(InvalidQuantity, match="calibrate with --force-n 0.3, or train on a sweep of 0.5 N"):
        answers.estimator(recording, "paper")
    alone = replace(
        simulated_config("SIM-LINEAR"), serial="SIM-0001", standard_model=tmp_path / "a", quick_model=tmp_path / "b"
    )
    with pytest.raises(ForeignCalibration, match="calibration's force_n is 0.5 N"):
        answers_for(alone, trained, calibration)


def test_a_probe_whose_settings_ask_for_a_mode_without_a_model_does_not_start(tmp_path):
    press = PressSection(mode="standard")
    config = replace(simulated_config(), data=tmp_path, standard_model=tmp_path / "none", press=press)
    with pytest.raises(StartFailed, match=r"press\.mode is standard, but this probe has models for quick, paper only"):
        open_simulated_probe(config, Scenario())


@pytest.mark.parametrize("name", ["standard_model", "quick_model"])
def test_a_model_that_is_named_and_not_there_stops_the_start(tmp_path, name):
    """Without the setting a probe does without such a model; a path that leads nowhere is a mistake."""
    config = replace(simulated_config(), data=tmp_path, **{name: tmp_path / "none"})
    with pytest.raises(StartFailed, match=rf"E001 {name} is .*none, which holds no model of mode \w+ for SIM-0001"):
        open_simulated_probe(config, Scenario())


def test_a_probe_does_not_start_with_models_of_two_commissionings(bundle, tmp_path):
    other = tmp_path / "other-quick"
    copytree(Config.quick_model, other)
    edit_card(other, lambda card: card.update(surrogate_sha256="0" * 64))
    config = replace(simulated_config(), data=tmp_path / "data", quick_model=other)
    with pytest.raises(StartFailed, match=r"E401 Model bundle .*other-quick: surrogate_sha256 is 0+, but must be"):
        open_simulated_probe(config, Scenario())
    with pytest.raises(BundleRefused, match="other-quick"):
        answers_for(config, bundle, None)


def test_the_models_prove_themselves_as_long_as_their_golden_vectors_hold(bundle, calibration, monkeypatch):
    answers = answers_for(simulated_config(), bundle, calibration)
    answers.prove()
    wrong = {"estimate": np.zeros((9, 3)), "spread": np.zeros((9, 3))}
    monkeypatch.setattr(bundle._network, "run", lambda rows: wrong)
    with pytest.raises(ModelError, match=r"golden\.estimate") as refusal:
        answers.prove()
    assert refusal.value.code == "E401"


def test_a_scans_answer_is_that_of_its_recording_whatever_was_read_of_it_before(tables, bundle, calibration):
    """The daemon's, press by press, to the last bit what a program on a workstation says of the whole recording."""
    parameters = np.array([12.0, 6.0, 60.0, *NOMINAL.values()])
    scan = recorded_press(tables, parameters, "precise", 5, further_mm=(4.0,))
    config = simulated_config()
    answers, plain = (
        answers_for(config, bundle, calibration),
        read_models(bundle, config.quick_model, config.standard_model),
    )
    beside = tuple(frame for frame in scan.frames if frame.role != "press")
    answers.look_ahead(replace(scan, frames=beside))
    for count in (1, 2):
        so_far = replace(scan, frames=(*beside, *(f for f in scan.with_role("press") if f.ramp < count)))
        assert answers.adviser(so_far) == plain.advise(so_far, calibration)
    expected = plain.estimate(scan, "precise", calibration)
    assert answers.estimator(scan, "precise") == expected
    assert expected.size_mm.value is not None
