"""A release file becomes the release that runs, or is left; what ran before is back by itself."""

import shutil

import pytest
from updated_probe import IMPATIENT


def test_a_first_release_is_installed_committed_and_runs(probe):
    done = probe.run("install", probe.write("1.0", 10))
    assert (done.returncode, done.stderr) == (0, "")
    assert probe.require_whole() == "1.0+10"
    assert probe.layout.linked(probe.layout.updater) == "1.0+10"
    assert (probe.state.floor, probe.state.previous, probe.state.pending) == (10, None, None)
    assert probe.progress.state == "committed"


@pytest.mark.parametrize("codes", [["E101"], ["E001", "E201", "E301"]])
def test_a_first_release_is_committed_on_a_machine_whose_parts_are_not_wired_yet(probe, codes):
    """Nothing is there that it would be better to go back to, and its commands are what parts are looked for with."""
    done = probe.run(*IMPATIENT, "install", probe.write("1.0", 10, {"lacks": codes}))
    assert (done.returncode, done.stderr) == (0, "")
    assert probe.require_whole() == probe.state.committed == "1.0+10"
    assert probe.state.history[-1].reason == " ".join(f"{code} It is not there." for code in codes)


@pytest.mark.parametrize("codes", [["E401"], ["E101", "E000"]])
def test_a_first_release_that_does_not_start_for_its_own_sake_leaves_nothing_behind(probe, codes):
    done = probe.run(*IMPATIENT, "install", probe.write("1.0", 10, {"lacks": codes}))
    assert done.returncode == 1
    assert (probe.state.committed, probe.current, probe.releases()) == (None, None, [])


@pytest.mark.parametrize(("lacks", "is_committed"), [(["E101"], True), ([], True), (["E101", "E201"], False)])
def test_the_next_one_may_lack_what_the_first_lacked_and_no_more(probe, lacks, is_committed):
    assert probe.run(*IMPATIENT, "install", probe.write("1.0", 10, {"lacks": ["E101", "E301"]})).returncode == 0
    done = probe.run(*IMPATIENT, "install", probe.write("1.1", 11, {"lacks": lacks}))
    assert done.returncode == (0 if is_committed else 1), done.stderr
    assert probe.require_whole() == ("1.1+11" if is_committed else "1.0+10")


def test_the_next_one_is_left_where_the_one_before_had_the_part(probe):
    probe.install("1.0", 10)
    done = probe.run(*IMPATIENT, "install", probe.write("1.1", 11, {"lacks": ["E101"]}))
    assert done.returncode == 1
    assert probe.require_whole() == "1.0+10"


def test_the_next_one_takes_its_place_and_the_one_before_the_last_goes(probe):
    for counter in (10, 11, 12):
        probe.install(f"1.{counter}", counter)
    assert probe.require_whole() == "1.12+12"
    assert probe.releases() == ["1.11+11", "1.12+12"]
    assert probe.state.previous == "1.11+11"


@pytest.mark.parametrize(
    ("behaviour", "reason"),
    [
        ({"mute": True}, "the daemon does not answer"),
        ({"faults": {"camera": "E101"}}, r"camera is not ready (E101)"),
        ({"faults": {"answers": None}}, "answers is not ready"),
        ({"dies_after": 2}, "It was ready, and then the daemon does not answer"),
        ({"falls_back_after": 2}, "It was ready, and then what answers on port"),
        ({"says": "0.9+9"}, "the daemon that answers is 0.9+9"),
    ],
)
def test_a_release_that_is_not_healthy_is_left_and_the_one_before_is_back(probe, behaviour, reason):
    probe.install("1.0", 10)
    done = probe.run(*IMPATIENT, "install", probe.write("1.1", 11, behaviour))
    assert done.returncode == 1
    assert done.stderr.startswith("E013 1.1+11 was left: ")
    assert reason in done.stderr
    assert probe.require_whole() == "1.0+10"
    assert probe.releases() == ["1.0+10"]
    assert reason in probe.state.bad["1.1+11"]
    assert (probe.state.history[-1].event, probe.state.floor) == ("rolled_back", 10)
    assert (probe.progress.state, probe.progress.code) == ("rolled_back", "E013")
    assert reason in probe.progress.reason


def test_a_release_that_refuses_the_settings_is_left_with_their_name_and_may_be_sent_again(probe):
    probe.install("1.0", 10)
    done = probe.run("install", probe.write("1.1", 11, {"refuses": "light.power"}))
    assert (done.returncode, probe.require_whole(), probe.state.bad) == (1, "1.0+10", {})
    assert done.stderr.startswith("E013 1.1+11 was left: It refuses settings that the release before took (E002): ")
    assert "light.power in /etc/tsis/config.toml" in probe.progress.reason
    probe.install("1.1", 11)


def test_settings_that_were_refused_before_keep_no_release_away(probe):
    probe.install("1.0", 10, {"refuses": "light.power"})
    probe.install("1.1", 11, {"refuses": "light.power"})
    probe.install("1.2", 12)
    assert probe.run("roll-back").returncode == 0
    assert probe.state.committed == "1.1+11"


def test_a_committed_release_that_the_disk_has_damaged_is_not_called_installed(probe):
    """The same file cannot mend what runs: it says so, and what to do."""
    file = probe.write("1.0", 10)
    assert probe.run("install", file).returncode == 0
    assert probe.run("install", file).returncode == 0
    harmed = next(path for path in probe.layout.release("1.0+10").rglob("*.py") if not path.is_symlink())
    harmed.chmod(0o644)
    harmed.write_bytes(harmed.read_bytes() + b"#")
    done = probe.run("install", file)
    assert done.returncode == 1
    assert f"damaged: {harmed.relative_to(probe.layout.release('1.0+10'))} has changed. Build it anew" in done.stderr
    probe.install("1.0", 11)


def test_where_a_bad_card_has_taken_the_release_the_next_one_is_installed(probe):
    probe.install("1.0", 10)
    probe.stop()
    shutil.rmtree(probe.layout.release("1.0+10"))
    probe.install("1.1", 11)
    assert probe.state.floor == 11
