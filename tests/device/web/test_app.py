"""Modes and certificates over REST, against a procedure that only writes down what it is asked for."""

import asyncio
import types
from dataclasses import replace

import httpx
import pytest
from small_certificate import small_certificate

from device.config import Config
from device.errors import BusyError, ModeUnavailable, ZeroShiftError
from device.instrument.press.cost import ModeOffer, press_cost
from device.instrument.self_test.report import CheckResult, SelfTestJob
from device.instrument.status import PressJob
from device.instrument.watch.calibration_watch import CalibrationWatch
from device.measurement.mode import ModeWorth
from device.records.calibrations import Calibrations
from device.web.app import create_app
from device.web.schema import Device, SelfTest, Tare

OF_UNKNOWNS = {"size_mm": 3.3, "depth_mm": 3.0, "youngs_modulus_kpa": 47.0}
WORTH = ModeWorth(0.1, 0.9, OF_UNKNOWNS, dict.fromkeys(OF_UNKNOWNS, 0.5))


class Procedure:
    """A probe with two modes."""

    def __init__(self):
        self.config, self.modes, self.is_simulated, self.asked = Config(), ("paper", "standard"), True, []
        self.calibration = CalibrationWatch(None)
        self.bench = types.SimpleNamespace(force=types.SimpleNamespace(zero_shift_n=0.051))
        self.refusal = None

    def request(self, mode=None):
        self.asked.append(mode)
        if mode not in (None, *self.modes):
            raise ModeUnavailable(f"This probe has no model for the mode {mode}.", "Choose one of those it has.")
        return PressJob("p-1", mode or "paper")

    def offers(self):
        cost = press_cost("standard", self.config)
        return [ModeOffer(press_cost("paper", self.config), None, 0, None), ModeOffer(cost, 0.412, 3, WORTH)]

    def tare(self):
        if self.refusal:
            raise self.refusal
        return 0.01234567

    def request_self_test(self, *, on_block, weight_n):
        self.asked.append((on_block, weight_n))
        return SelfTestJob("s-1", "2026-01-01T00:00:00Z", on_block, weight_n)

    @property
    def self_test(self):
        return SelfTestJob(
            "s-1", "2026-01-01T00:00:00Z", state="done", results=(CheckResult("Light", "LED +x", "passed"),)
        )


@pytest.fixture
def procedure():
    return Procedure()


@pytest.fixture
def ask(procedure):
    app = create_app(procedure, types.SimpleNamespace(light_on_s=12.34))

    def asking(method, path, **content):
        async def answer():
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
                headers = {"content-type": "application/json"}
                return await client.request(method, path, headers=headers, **content)

        return asyncio.run(answer())

    return asking


@pytest.mark.parametrize(
    ("content", "asked", "mode"),
    [({}, None, "paper"), ({"json": {}}, None, "paper"), ({"json": {"mode": "standard"}}, "standard", "standard")],
)
def test_a_press_is_asked_for_in_a_mode_or_in_none(ask, procedure, content, asked, mode):
    answer = ask("POST", "/api/v1/presses", **content)
    assert answer.status_code == 202
    assert answer.json()["mode"] == mode
    assert procedure.asked == [asked]


def test_an_unknown_mode_is_refused_with_all_there_are(ask, procedure):
    answer = ask("POST", "/api/v1/presses", json={"mode": "fast"})
    assert (answer.status_code, answer.json()["code"]) == (422, "E803")
    assert answer.headers["content-type"] == "application/problem+json"
    assert all(mode in answer.json()["detail"] for mode in ("quick", "standard", "precise", "paper"))
    assert procedure.asked == []


def test_a_mode_without_a_model_is_refused_with_its_own_code(ask):
    answer = ask("POST", "/api/v1/presses", json={"mode": "precise"})
    assert (answer.status_code, answer.json()["code"]) == (422, "E805")


def test_the_device_says_how_long_its_leds_were_on_and_in_which_modes_it_measures_at_what_cost(ask):
    device = ask("GET", "/api/v1/device").json()
    assert Device.model_validate(device).default_mode == "standard"
    assert device["light_on_s"] == 12.3
    assert device["modes"] == [
        {"mode": "paper", "frames": 10, "kind": "hold", "from_n": 0.5, "to_n": 0.5, "seconds": 0.5}
        | {"answer_s": None, "answer_presses": 0}
        | dict.fromkeys(("typical_error_percent", "answered_ratio", "determined_ratio")),
        {"mode": "standard", "frames": 10, "kind": "ramp", "from_n": 0.08, "to_n": 0.6, "seconds": 3.0}
        | {"answer_s": 0.412, "answer_presses": 3, "answered_ratio": 0.9}
        | {"typical_error_percent": WORTH.median_percent, "determined_ratio": WORTH.determined_ratio},
    ]


@pytest.mark.parametrize(
    ("content", "asked"),
    [({}, (False, None)), ({"json": {"on_block": True, "weight_n": 0.5}}, (True, 0.5))],
)
def test_a_self_test_is_started_and_found_where_it_says(ask, procedure, content, asked):
    answer = ask("POST", "/api/v1/self-test", **content)
    assert (answer.status_code, answer.headers["location"]) == (202, "/api/v1/self-test")
    assert SelfTest.model_validate(answer.json()).state == "waiting"
    assert procedure.asked == [asked]


def test_the_results_of_a_self_test_are_as_described_and_say_that_the_probe_is_simulated(ask):
    answer = ask("GET", "/api/v1/self-test").json()
    assert SelfTest.model_validate(answer).verdict == "passed"
    assert answer["simulated"] is True
    assert [result["check"] for result in answer["results"]] == ["LED +x"]


def test_an_unknown_wish_for_a_self_test_is_refused(ask, procedure):
    answer = ask("POST", "/api/v1/self-test", json={"weight_g": 50})
    assert (answer.status_code, answer.json()["code"]) == (422, "E803")
    assert procedure.asked == []


def test_a_tare_says_by_how_much_the_zero_has_moved_and_how_far_it_is_from_that_of_commissioning(ask):
    answer = ask("POST", "/api/v1/tare")
    assert answer.status_code == 200
    assert Tare.model_validate(answer.json()) == Tare(moved_n=0.0123, zero_shift_n=0.051)


@pytest.mark.parametrize(
    ("refusal", "status"),
    [(BusyError("A press is under way.", "Wait."), 409), (ZeroShiftError("It is 2 N off.", "Lift the probe."), 503)],
)
def test_a_tare_during_a_press_or_of_a_held_probe_is_a_problem_with_its_code(ask, procedure, refusal, status):
    procedure.refusal = refusal
    answer = ask("POST", "/api/v1/tare")
    assert (answer.status_code, answer.json()["code"]) == (status, refusal.code)
    assert answer.json()["remedy"] == refusal.remedy


def test_the_certificates_are_listed_with_the_active_one_and_the_one_in_use(ask, procedure, tmp_path):
    """Activated since the start: it is in use only from the next one on."""
    procedure.config = replace(procedure.config, calibration=tmp_path)
    assert ask("GET", "/api/v1/calibrations").json() == {"active": None, "in_use": None, "calibrations": []}
    used, newer = small_certificate(), small_certificate(operator="Another")
    for certificate in (used, newer):
        (tmp_path / f"{certificate.id}.json").write_text(certificate.to_json())
    Calibrations(tmp_path).activate(newer.id)
    procedure.calibration = CalibrationWatch(used)
    answer = ask("GET", "/api/v1/calibrations").json()
    assert (answer["active"], answer["in_use"]) == (newer.id, used.id)
    listed = {one["id"]: one for one in answer["calibrations"]}
    assert listed[newer.id]["operator"] == "Another"
    assert "held_out" not in listed[used.id]


def test_certificates_are_not_written_over_rest(ask):
    assert ask("POST", "/api/v1/calibrations", json={}).status_code == 405


def test_a_folder_of_certificates_that_is_gone_is_a_problem_with_its_code(ask, procedure, tmp_path):
    procedure.config = replace(procedure.config, calibration=tmp_path / "none")
    answer = ask("GET", "/api/v1/calibrations")
    assert (answer.status_code, answer.json()["code"]) == (503, "E402")
