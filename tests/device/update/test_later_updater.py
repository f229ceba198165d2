"""What an updater makes of a state.json that a later one wrote, or that nobody can read: no floor is lost."""

import json

import pytest

from device.update.state import PendingRelease, UpdateState, read_state, write_state

MORE = {"more": {"by": "a later updater"}}


def add_to_state(layout, change):
    record = json.loads(layout.state.read_bytes())
    change(record)
    layout.state.write_text(json.dumps(record))


@pytest.fixture
def gone_back(probe):
    """1.1+11 failed, 1.2+12 was committed, and an operator went back to 1.0+10."""
    probe.install("1.0", 10)
    ill = probe.write("1.1", 11, {"faults": {"store": "E601"}})
    assert probe.run("--health-within", "1", "install", ill).returncode == 1
    probe.install("1.2", 12)
    add_to_state(probe.layout, lambda record: record["bad"].update({"1.3+13": "store is not ready (E601)"}))
    assert probe.run("roll-back").returncode == 0
    assert (probe.state.committed, probe.state.previous, probe.state.floor) == ("1.0+10", "1.2+12", 12)
    return probe


def test_a_field_of_a_later_updater_costs_neither_floor_nor_bad_ones_nor_the_newer_release(gone_back):
    def of_later(record):
        record.update(MORE)
        record["history"][-1].update(MORE)

    add_to_state(gone_back.layout, of_later)
    before = gone_back.state
    gone_back.start_machine()
    assert gone_back.state == before
    assert (before.floor, before.previous, list(before.bad)) == (12, "1.2+12", ["1.3+13"])
    assert gone_back.releases() == ["1.0+10", "1.2+12"]


def test_what_a_later_updater_wrote_is_written_again_where_it_stood(gone_back):
    def of_later(record):
        record.update(MORE)
        record["history"][-1].update(MORE)

    add_to_state(gone_back.layout, of_later)
    assert gone_back.run("roll-back").returncode == 0
    record = json.loads(gone_back.layout.state.read_bytes())
    assert record["more"] == MORE["more"]
    assert ["more" in event for event in record["history"]][-2:] == [True, False]
    assert gone_back.said()["state"]["more"] == MORE["more"]


def test_a_trial_keeps_what_a_later_updater_wrote_of_it(probe):
    write_state(probe.layout, UpdateState(pending=PendingRelease("1.1+11")))
    add_to_state(probe.layout, lambda record: record["pending"].update(MORE))
    state = read_state(probe.layout)
    write_state(probe.layout, state)
    assert json.loads(probe.layout.state.read_bytes())["pending"] | MORE == state.as_record()["pending"]


def damaged(record):
    record["floor"] = "many"


def of_another_schema(record):
    record.update(schema="tsis.update_state/2", floor=20)


@pytest.mark.parametrize(("change", "floor"), [(damaged, 12), (of_another_schema, 20), (None, 12)])
def test_where_it_cannot_be_read_the_floor_stays_and_it_is_told(gone_back, change, floor):
    if change:
        add_to_state(gone_back.layout, change)
    else:
        gone_back.layout.state.unlink()
    assert f"the floor is {floor}" in gone_back.start_machine().stderr
    state = gone_back.state
    assert (state.committed, state.previous, state.floor) == ("1.0+10", "1.2+12", floor)
    assert (state.history[-1].event, f"the floor is {floor}" in state.history[-1].reason) == ("recovered", True)
    assert gone_back.releases() == ["1.0+10", "1.2+12"]
    assert "recovered: state.json" in gone_back.run("status").stdout
    refused = gone_back.run("install", gone_back.write("1.1", 11))
    assert refused.returncode == 1
    assert f"one of {floor} was already in use here" in refused.stderr


def test_a_field_of_a_later_updater_in_the_progress_leaves_the_rest(probe):
    probe.install("1.0", 10)
    told = json.loads(probe.layout.progress.read_bytes())
    probe.layout.progress.write_text(json.dumps(told | MORE))
    assert (probe.progress.state, probe.progress.release) == ("committed", "1.0+10")
