"""What the procedure knows of models: the modes in which they answer, and that each run of one is progress."""

import pytest
from stand_in_adviser import no_advice

from device.errors import ConfigError
from device.instrument.press.probe_answers import ProbeAnswers
from device.instrument.watch.progress import ProgressBoard


def test_a_mode_without_a_model_is_no_default():
    answers = ProbeAnswers(("quick", "paper"), lambda recording, mode: None, no_advice)
    answers.require("quick")
    with pytest.raises(ConfigError, match=r"press\.mode is precise, but .* models for quick, paper only") as refusal:
        answers.require("precise")
    assert refusal.value.code == "E001"


def test_every_run_of_a_watched_answer_is_progress_of_the_inference():
    now_s, begun = [0.0], []
    progress = ProgressBoard(lambda: now_s[0])
    unwatched = ProbeAnswers(("paper",), lambda recording, mode: mode, lambda recording: "advice")
    answers = unwatched.watched(progress, lambda: begun.append(now_s[0]))
    now_s[0] = 20.0
    assert answers.adviser(None) == "advice"
    assert "inference" not in progress.stall(15.0).parts
    now_s[0] = 40.0
    assert answers.estimator(None, "paper") == "paper"
    assert "inference" not in progress.stall(15.0).parts
    now_s[0] = 80.0
    answers.prove()
    assert "inference" not in progress.stall(15.0).parts
    assert begun == [20.0, 40.0, 80.0]
