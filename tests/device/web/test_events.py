"""The status as the screen gets it: faults and warnings with code, title, severity, cause and remedy."""

import asyncio
import types
from contextlib import ExitStack
from dataclasses import replace

import pytest
from stand_in_adviser import advice

from device.config import PressSection
from device.errors import (
    ArchiveUnreachable,
    CertificateEnds,
    ClockJumpError,
    LightBusError,
    StalledError,
    UnpluggedCellError,
    WebhookFailed,
)
from device.instrument.press.states import Guidance, PressState
from device.instrument.status import PressJob, ProcedureStatus, ScanProgress, StatusBoard
from device.web import events, schema
from device.web.events import (
    ALIVE_S,
    EVENT_INTERVAL_S,
    LONGEST_INTERVAL_S,
    STILL_N,
    StatusFeed,
    snapshot,
    status_events,
)


class Force:
    """A load cell at 0.25 N or another force, or at fault."""

    def __init__(self, fault=None, force_n=0.25):
        self.fault, self.force_n = fault, force_n

    @property
    def latest_n(self):
        if self.fault:
            raise self.fault
        return self.force_n


@pytest.fixture
def told():
    """Return the snapshot of a procedure with a status and a force."""

    def tell(status, force):
        config = types.SimpleNamespace(serial="SIM-0001", press=PressSection())
        board, bench = types.SimpleNamespace(now=status), types.SimpleNamespace(force=force)
        probe = types.SimpleNamespace(config=config, mode="standard", board=board, bench=bench, is_simulated=True)
        return snapshot(probe)

    return tell


def test_a_probe_without_a_fault_tells_its_force_and_no_fault(told):
    status = told(ProcedureStatus(), Force())
    assert (status["force_n"], status["faults"]) == (0.25, [])


def test_what_the_network_hears_of_is_told_with_the_warnings(told):
    archive, webhook = ArchiveUnreachable("Down.", "Look."), WebhookFailed("Down.", "Look.")
    status = told(
        ProcedureStatus(archive=archive, webhook=webhook, certificate=CertificateEnds("Soon.", "Renew it.")), Force()
    )
    assert [fault["code"] for fault in status["faults"]] == ["E030", "E032", "E022"]


def test_a_fault_comes_before_the_warnings_and_each_says_what_it_is(told):
    fault, warning = LightBusError("The bus is stuck.", "Switch off."), ClockJumpError("It was set.", "Check it.")
    status = told(ProcedureStatus(fault=fault, warnings=(warning,)), Force())
    assert schema.Status.model_validate(status).step == "starting"
    assert status["faults"] == [
        {
            "code": "E202",
            "title": "I2C bus stuck",
            "severity": "fault",
            "cause": "The bus is stuck.",
            "remedy": "Switch off.",
        },
        {
            "code": "E701",
            "title": "Clock was set",
            "severity": "warning",
            "cause": "It was set.",
            "remedy": "Check it.",
        },
    ]


def test_a_load_cell_at_fault_is_told_at_once_and_has_no_force(told):
    status = told(ProcedureStatus(), Force(UnpluggedCellError("It is gone.", "Plug it in.")))
    assert status["force_n"] is None
    assert [fault["code"] for fault in status["faults"]] == ["E304"]


def test_a_hold_has_a_narrow_band_around_its_target(told):
    status = told(
        ProcedureStatus(press=PressJob("p-1", "quick", "capturing"), frames_taken=0, wanted_n=(0.5,)), Force()
    )
    assert (status["mode"], status["kind"], status["frames_needed"]) == ("quick", "hold", 1)
    assert status["band_n"] == pytest.approx((0.475, 0.525))
    assert status["wanted_n"] == (0.5,)


def test_a_ramp_has_the_forces_at_which_frames_are_still_wanted(told):
    job = PressJob("p-1", "standard", "capturing")
    status = told(ProcedureStatus(step="lesion", press=job, frames_taken=9, wanted_n=(0.6,)), Force())
    assert (status["mode"], status["kind"], status["frames_needed"]) == ("standard", "ramp", 10)
    assert status["band_n"] == pytest.approx((0.08, 0.6))
    assert status["wanted_n"] == (0.6,)
    reference = told(ProcedureStatus(step="reference", press=job, wanted_n=(0.62,)), Force())
    assert reference["band_n"] == pytest.approx((0.06, 0.62))


def test_a_scan_says_how_sure_it_is_and_how_far_aside_to_go_as_long_as_it_is_under_way(told):
    scan, job = ScanProgress(1, 5, advice(2.0, 6.0), 6.0), PressJob("p-1", "precise", "capturing", ramps=1)
    under_way = ProcedureStatus(step="lesion", press=job, guidance=Guidance.MOVE_ASIDE, scan=scan)
    status = told(under_way, Force())
    assert schema.Status.model_validate(status).scan == schema.ScanStatus(**scan.as_record())
    assert status["scan"]["next_offset_mm"] == 6.0
    assert status["guidance"] == {
        "code": "move_aside", "text": "Move the probe about 6 mm to the side, touch again"
    }  # fmt: skip
    assert told(replace(under_way, press=replace(job, state="done")), Force())["scan"] is None
    assert told(ProcedureStatus(), Force())["scan"] is None


@pytest.mark.parametrize(
    ("step", "state", "guidance"),
    [("result", PressState.DONE, Guidance.DONE), ("rejected", PressState.REJECTED, Guidance.REJECTED)],
)
def test_a_press_that_was_asked_for_is_not_told_with_how_the_one_before_ended(told, step, state, guidance):
    over = ProcedureStatus(step=step, state=state, guidance=guidance, press=PressJob("p-2", "quick"))
    status = told(over, Force(force_n=0.001))
    assert (status["press"]["id"], status["press"]["state"], status["mode"]) == ("p-2", "waiting", "quick")
    assert (status["step"], status["press_state"], status["guidance"]["code"]) == ("ready", "idle", "press_beside")
    held = told(replace(over, guidance=Guidance.LIFT), Force())
    assert held["guidance"]["code"] == "lift"
    still_pressed = told(over, Force(force_n=0.3))
    assert (still_pressed["step"], still_pressed["guidance"]["code"]) == ("ready", "lift")


def test_the_state_of_the_press_is_told_by_its_code(told):
    assert told(ProcedureStatus(), Force())["press_state"] == "idle"
    assert told(ProcedureStatus(state=PressState.TOO_HARD), Force())["press_state"] == "too_hard"


def test_before_a_press_the_mode_is_that_of_the_settings(told):
    status = told(ProcedureStatus(press=PressJob("p-1", "paper", "done"), wanted_n=()), Force())
    assert (status["mode"], status["kind"], len(status["wanted_n"])) == ("standard", "ramp", 10)


def test_a_press_that_failed_has_its_code(told):
    status = told(ProcedureStatus(press=PressJob("p-1", "paper", "failed", code="E203", reason="No light.")), Force())
    assert (status["press"]["code"], status["press"]["warnings"]) == ("E203", ())


def test_a_part_that_makes_no_progress_is_a_fault_whatever_the_frozen_procedure_says(told):
    stall = StalledError("The LED chip made no progress for 7.6 s.", "Wait.")
    status = told(ProcedureStatus(step="reference", guidance=Guidance.HOLD_STILL, stall=stall), Force())
    assert (status["step"], status["guidance"]["code"]) == ("fault", "fault")
    assert [fault["code"] for fault in status["faults"]] == ["E901"]


class Told:
    """A procedure whose force and clock are written down here, and how often its status was put together."""

    def __init__(self, monkeypatch):
        self.config = types.SimpleNamespace(serial="SIM-0001", press=PressSection())
        self.board, self.mode, self.is_simulated = StatusBoard(), "standard", True
        self.bench = types.SimpleNamespace(force=types.SimpleNamespace(latest_n=0.25))
        self.now_s, self.built = 100.0, 0
        monkeypatch.setattr(events, "snapshot", self._snapshot)
        self.feed = StatusFeed(self, clock=lambda: self.now_s)

    def _snapshot(self, procedure):
        self.built += 1
        return snapshot(procedure)


@pytest.fixture
def procedure(monkeypatch):
    return Told(monkeypatch)


def test_an_event_is_built_anew_only_when_there_is_something_to_tell(procedure):
    event = procedure.feed.event()
    procedure.bench.force.latest_n += 0.9 * STILL_N
    procedure.now_s += 0.9 * ALIVE_S
    assert procedure.feed.event() is event
    procedure.bench.force.latest_n += 0.2 * STILL_N
    moved = procedure.feed.event()
    assert f'"force_n": {0.25 + 1.1 * STILL_N:.4f}' in moved.raw_data
    procedure.board.update(guidance=Guidance.LIFT)
    assert '"lift"' in procedure.feed.event().raw_data
    assert procedure.built == 3


def test_a_silent_load_cell_is_told_at_once_and_once(procedure):
    procedure.feed.event()
    procedure.bench.force = Force(UnpluggedCellError("It is gone.", "Plug it in."))
    event = procedure.feed.event()
    assert '"force_n": null' in event.raw_data
    assert procedure.feed.event() is event
    procedure.bench.force = Force()
    assert '"force_n": 0.25' in procedure.feed.event().raw_data


def test_an_event_is_never_older_than_a_client_bears(procedure):
    event = procedure.feed.event()
    procedure.now_s += ALIVE_S
    assert procedure.feed.event() is not event


class Unchanged:
    """A store in which nothing is kept."""

    async def begin(self):
        return 7

    async def new(self):
        for nothing in ():
            yield nothing


def test_all_clients_get_the_event_that_was_built_once_and_only_once(procedure, monkeypatch):
    """Five clients through a hundred looks, of which the third and the tenth find something new."""
    looks, clients, told = 0, 5, []
    sleep = asyncio.sleep

    async def next_look(seconds):
        nonlocal looks
        assert seconds == EVENT_INTERVAL_S
        looks += 1
        if looks in (3 * clients, 10 * clients):
            procedure.bench.force.latest_n += 0.1
        await sleep(0)

    async def follow():
        stream = status_events(procedure.feed, Unchanged())
        told.append([(await anext(stream)).raw_data for _ in range(3)])
        await stream.aclose()

    async def all_follow():
        await asyncio.gather(*(follow() for _ in range(clients)))

    monkeypatch.setattr(asyncio, "sleep", next_look)
    asyncio.run(all_follow())
    assert procedure.built == 3
    assert all(one == told[0] for one in told)


def test_many_streams_share_the_time_of_one_loop_and_none_is_told_too_seldom():
    feed = StatusFeed(types.SimpleNamespace())
    with ExitStack() as opened:
        intervals_s = []
        for _ in range(200):
            opened.enter_context(feed.stream())
            intervals_s.append(feed.interval_s)
        assert intervals_s[:12] == [EVENT_INTERVAL_S] * 12
        assert intervals_s[49] == pytest.approx(0.25)
        assert max(intervals_s) == LONGEST_INTERVAL_S < ALIVE_S
    assert feed.interval_s == EVENT_INTERVAL_S


def test_a_stream_counts_until_its_client_goes(procedure):
    async def open_and_close():
        streams = [status_events(procedure.feed, Unchanged()) for _ in range(50)]
        for stream in streams:
            await anext(stream)
        beside_fifty_s = procedure.feed.interval_s
        for stream in streams:
            await stream.aclose()
        return beside_fifty_s

    assert asyncio.run(open_and_close()) == pytest.approx(0.25)
    assert procedure.feed.interval_s == EVENT_INTERVAL_S
