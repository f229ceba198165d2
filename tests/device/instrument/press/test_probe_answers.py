"""What the procedure knows of models: the modes in which they answer, and that each run of one is progress."""

import pytest
from stand_in_adviser import no_advice

from device.errors import ConfigError
from device.instrument.press.probe_answers import ProbeAnswers
from device.instrument.watch.progress import ProgressBoard


def test_a_mode_without_a_model_is_no_default():
    answers = ProbeAnswers(("quick", "paper"), lambda recording, mode: None, no_advice)
    assert answers.mode_unless_asked("quick") == "quick"
    with pytest.raises(ConfigError, match=r"press\.mode is precise, but .* models for quick, paper only") as refusal:
        answers.mode_unless_asked("precise")
    assert refusal.value.code == "E001"


@pytest.mark.parametrize(
    ("modes", "taken"),
    [(("paper", "quick", "standard", "precise"), "standard"), (("paper", "quick"), "quick"), (("paper",), "paper")],
)
def test_without_a_setting_a_press_is_in_the_best_mode_that_this_probe_has(modes, taken):
    """A new probe has that of the paper alone, and starts all the same."""
    assert ProbeAnswers(modes, lambda recording, mode: None, no_advice).mode_unless_asked(None) == taken


def test_a_probe_without_any_model_says_so():
    with pytest.raises(ConfigError, match="No model is for this probe"):
        ProbeAnswers((), lambda recording, mode: None, no_advice).mode_unless_asked(None)


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
