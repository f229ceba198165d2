"""Modes and certificates over REST, against a procedure that only writes down what it is asked for."""

import asyncio
import json
import types
from dataclasses import replace

import httpx
import pytest
from small_certificate import small_certificate

from device.access.request_rules import ENDLESS
from device.config import Config
from device.errors import BusyError, ModeUnavailable, UnknownResource, ZeroShiftError
from device.instrument.press.cost import ModeOffer, press_cost
from device.instrument.self_test.report import CheckResult, SelfTestJob
from device.instrument.status import PressJob
from device.instrument.watch.calibration_watch import CalibrationWatch
from device.measurement.mode import ModeWorth
from device.measurement.wanted_accuracy import WantedAccuracy
from device.records.calibrations import Calibrations
from device.records.exams import AskedExam
from device.web.app import create_app
from device.web.schema import Device, PressResource, SelfTest, Tare

OF_UNKNOWNS = {"size_mm": 3.3, "depth_mm": 3.0, "youngs_modulus_kpa": 47.0}
WORTH = ModeWorth(0.1, 0.9, OF_UNKNOWNS, dict.fromkeys(OF_UNKNOWNS, 0.5))


class Procedure:
    """A probe with two modes."""

    def __init__(self):
        self.config, self.modes, self.is_simulated, self.asked = Config(), ("paper", "standard"), True, []
        self.mode = "standard"
        self.calibration = CalibrationWatch(None)
        self.bench = types.SimpleNamespace(force=types.SimpleNamespace(zero_shift_n=0.051))
        self.refusal, self.obeyed = None, {}

    def request(self, mode=None, wanted=None, *, exam=None):
        self.asked.append(mode)
        self.wanted, self.exam = wanted, exam
        if mode not in (None, *self.modes):
            raise ModeUnavailable(f"This probe has no model for the mode {mode}.", "Choose one of those it has.")
        return PressJob("p-1", mode or "paper")

    def request_once(self, once, mode=None, wanted=None, *, exam=None):
        if once.request not in self.obeyed:
            self.obeyed[once.request] = self.request(mode, wanted, exam=exam).as_record()
        return self.obeyed[once.request]

    def offers(self):
        cost = press_cost("standard", self.config)
        return [ModeOffer(press_cost("paper", self.config), None, 0, None), ModeOffer(cost, 0.412, 3, WORTH)]

    def finish(self, press_id):
        if self.refusal:
            raise self.refusal
        self.asked.append(press_id)

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
    kept = types.SimpleNamespace(light_on_s=12.34, press=lambda press_id: PressJob(press_id, "precise").as_record())
    app = create_app(procedure, kept)

    def asking(method, path, headers=None, **content):
        async def answer():
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
                of_all = {"content-type": "application/json", **(headers or {})}
                return await client.request(method, path, headers=of_all, **content)

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


def test_a_scan_is_asked_for_an_accuracy_within_a_time(ask, procedure):
    procedure.modes = ("precise",)
    asked = {"mode": "precise", "until": {"size_mm": 1, "youngs_modulus_kpa": 12.5}, "within_s": 30}
    assert ask("POST", "/api/v1/presses", json=asked).status_code == 202
    assert procedure.wanted == WantedAccuracy({"size_mm": 1, "youngs_modulus_kpa": 12.5}, 30)
    assert ask("POST", "/api/v1/presses", json={"mode": "precise"}).status_code == 202
    assert not procedure.wanted.is_asked


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ('{"until": {"depth_mm": NaN}}', "until.depth_mm is nan, but must be above 0 and at most 20 mm."),
        ('{"until": {"depth_mm": Infinity}}', "until.depth_mm is inf, but must be above 0 and at most 20 mm."),
        ('{"until": {"depth_mm": 0}}', "until.depth_mm is 0, but must be above 0 and at most 20 mm."),
        ('{"until": {"size_mm": -1.5}}', "until.size_mm is -1.5, but must be above 0 and at most 20 mm."),
        ('{"until": {"size_mm": true}}', "until.size_mm is True, but must be a number above 0 and at most 20 mm."),
        ('{"until": {"size_mm": "1"}}', "until.size_mm is '1', but must be a number above 0 and at most 20 mm."),
        ('{"until": {"size_mm": 1' + 400 * "0" + "}}", "until.size_mm is inf, but must be above 0 and at most 20 mm."),
        ('{"until": {"youngs_modulus_kpa": 201}}', "but must be above 0 and at most 200 kPa."),
        ('{"until": {"radius_mm": 1}}', "until is 'radius_mm', but must be of size_mm, depth_mm, youngs_modulus_kpa."),
        ('{"until": 1.0}', "until"),
        ('{"within_s": 4.9}', "within_s is 4.9, but must be at least 5 and at most 300 s."),
        ('{"within_s": 301}', "within_s is 301, but must be at least 5 and at most 300 s."),
        ('{"within_s": true}', "within_s is True, but must be a number at least 5 and at most 300 s."),
    ],
)
def test_an_accuracy_that_nothing_can_have_is_refused_with_the_range(ask, procedure, content, told):
    answer = ask("POST", "/api/v1/presses", content=content)
    assert (answer.status_code, answer.json()["code"]) == (422, "E803")
    assert told in answer.json()["detail"]
    assert procedure.asked == []


def test_a_press_with_a_key_is_asked_for_once_however_its_fields_are_ordered(ask, procedure):
    bodies = ('{"mode": "paper", "until": null}', '{"until":null, "mode":"paper"}')
    answers = [ask("POST", "/api/v1/presses", headers={"Idempotency-Key": "k-1"}, content=body) for body in bodies]
    assert procedure.asked == ["paper"]
    assert list(procedure.obeyed) == [
        'POST /api/v1/presses {"exam_id": null, "mode": "paper", "until": null, "within_s": null}'
    ]
    assert len({(one.status_code, one.headers["location"], one.content) for one in answers}) == 1


def test_all_that_is_wrong_with_a_request_is_told_at_once_with_its_values(ask):
    told = ask("GET", "/api/v1/presses?limit=201&from=x").json()
    assert "query.limit is '201', but must be less than or equal to 200" in told["detail"]
    assert "query.from is 'x'" in told["detail"]
    shifted = ask("GET", "/api/v1/presses?from=2026-11-23T08:00:00+02:00").json()
    assert "%2B" in shifted["remedy"]


def test_a_parameter_that_is_there_twice_is_refused(ask):
    answer = ask("GET", "/api/v1/presses?limit=1&limit=2")
    assert (answer.status_code, answer.json()["detail"]) == (422, "query.limit is there 2 times.")


def test_head_is_answered_as_get_without_a_body_but_for_what_never_ends(ask):
    got, head = (ask(method, "/api/v1/presses/p-1") for method in ("GET", "HEAD"))
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers["content-length"] == got.headers["content-length"] == str(len(got.content))
    assert ask("HEAD", "/api/v1/presses/p-1", headers={"host": "elsewhere"}).status_code == 421
    for endless in ENDLESS:
        refused = ask("HEAD", endless)
        assert (refused.status_code, refused.headers["allow"]) == (405, "GET")


EXAM_ID = "0b0f7f2e-6a1f-4d53-9d5e-0a8a4a2f6c11"


@pytest.mark.parametrize(("headers", "version"), [({}, None), ({"If-Match": '"3"'}, 3)])
def test_a_press_is_of_the_exam_that_it_names_as_its_client_has_seen_it(ask, procedure, headers, version):
    assert ask("POST", "/api/v1/presses", headers=headers, json={"exam_id": EXAM_ID}).status_code == 202
    assert procedure.exam == AskedExam(EXAM_ID, version)
    assert ask("POST", "/api/v1/presses").status_code == 202
    assert procedure.exam is None


@pytest.mark.parametrize(
    ("headers", "exam_id"),
    [({}, "none"), ({}, "\ud800"), ({}, 7), ({"If-Match": "3"}, EXAM_ID), ({"If-Match": "*"}, EXAM_ID)],
)
def test_a_press_of_what_is_no_exam_or_no_version_is_refused(ask, procedure, headers, exam_id):
    answer = ask("POST", "/api/v1/presses", headers=headers, content=json.dumps({"exam_id": exam_id}))
    assert (answer.status_code, answer.json()["code"]) == (422, "E803")
    assert procedure.asked == []


def test_a_version_of_no_exam_is_refused_and_no_press_of_nobody_is_begun(ask, procedure):
    answer = ask("POST", "/api/v1/presses", headers={"If-Match": '"3"'}, json={"mode": "quick"})
    assert (answer.status_code, answer.json()["code"]) == (422, "E803")
    assert "there is no exam_id" in answer.json()["detail"]
    assert procedure.asked == []


@pytest.mark.parametrize("key", ["", "two words", "k" * 256, "caf\u00e9".encode(), b"\xff"])
def test_a_key_that_is_no_name_is_refused_and_nothing_is_done(ask, procedure, key):
    answer = ask("POST", "/api/v1/presses", headers={"Idempotency-Key": key})
    assert (answer.status_code, answer.json()["code"]) == (422, "E803")
    assert procedure.asked == []


@pytest.mark.parametrize(
    ("method", "path", "allowed"),
    [
        ("PATCH", "presses/p-1", "DELETE, GET, HEAD"), ("DELETE", "presses", "GET, HEAD, POST"),
        ("PUT", "self-test", "GET, HEAD, POST"),
        ("POST", "openapi.json", "GET, HEAD"),
    ],
)  # fmt: skip
def test_a_method_that_a_path_does_not_take_is_answered_with_all_that_it_takes(ask, method, path, allowed):
    answer = ask(method, f"/api/v1/{path}")
    assert (answer.status_code, answer.json()["code"], answer.headers["allow"]) == (405, "E804", allowed)


def test_a_refused_press_says_who_holds_the_probe(ask, procedure):
    procedure.refusal = BusyError("A press is under way.", "Wait.")
    assert "holder" not in ask("POST", "/api/v1/tare").json()
    procedure.refusal.holder = {"kind": "press", "id": "p-1", "mode": "paper", "since": "2026-01-01T00:00:00Z"}
    assert ask("POST", "/api/v1/tare").json()["holder"] == procedure.refusal.holder


def test_a_scan_is_finished_by_its_id(ask, procedure):
    answer = ask("POST", "/api/v1/presses/p-7/finish")
    assert (answer.status_code, PressResource.model_validate(answer.json()).id) == (202, "p-7")
    assert procedure.asked == ["p-7"]


@pytest.mark.parametrize(
    ("refusal", "status"), [(BusyError("Not complete.", "Wait."), 409), (UnknownResource("None.", "Look."), 404)]
)
def test_a_scan_that_cannot_be_finished_is_a_problem_with_its_code(ask, procedure, refusal, status):
    procedure.refusal = refusal
    answer = ask("POST", "/api/v1/presses/p-7/finish")
    assert (answer.status_code, answer.json()["code"]) == (status, refusal.code)


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
        | {"answer_s": None, "answer_presses": 0, "fewest_ramps": 1, "most_ramps": 1, "band_n": [0.475, 0.525]}
        | dict.fromkeys(("typical_error_percent", "answered_ratio", "determined_ratio", "reachable_half_width"))
        | {"half_width_by_ramps": {}},
        {"mode": "standard", "frames": 10, "kind": "ramp", "from_n": 0.08, "to_n": 0.6, "seconds": 3.0}
        | {"answer_s": 0.412, "answer_presses": 3, "answered_ratio": 0.9, "reachable_half_width": None}
        | {"fewest_ramps": 1, "most_ramps": 1, "band_n": [0.08, 0.6], "half_width_by_ramps": {}}
        | {"typical_error_percent": WORTH.median_percent, "determined_ratio": WORTH.determined_ratio},
    ]


@pytest.mark.parametrize(
    ("content", "asked"),
    [
        ({}, (False, None)),
        ({"json": {"on_block": True, "weight_n": 0.5}}, (True, 0.5)),
        ({"json": {"weight_n": 1}}, (False, 1.0)),
    ],
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


@pytest.mark.parametrize(
    "wish", [{"weight_g": 50}, {"weight_n": True}, {"weight_n": "0.5"}, {"on_block": 0}, {"on_block": "yes"}]
)
def test_an_unknown_wish_for_a_self_test_and_one_of_another_type_is_refused(ask, procedure, wish):
    answer = ask("POST", "/api/v1/self-test", json=wish)
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
