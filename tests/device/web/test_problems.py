"""Every error is a problem document, also the ones that a running probe does not make on demand."""

import asyncio

import httpx
import pytest
from fastapi import FastAPI

from device.errors import CameraError, LightError, LoadCellError, ModelError, StorageError, TooManyTries
from device.measurement.quantities import InvalidQuantity
from device.web.problems import install_problems


@pytest.fixture
def ask():
    """Return the answer of an app whose only handler raises an error."""

    def asking(error):
        app = FastAPI()
        install_problems(app)

        @app.get("/broken")
        def broken():
            raise error

        async def answer():
            transport = httpx.ASGITransport(app, raise_app_exceptions=False)
            async with httpx.AsyncClient(transport=transport, base_url="http://probe") as client:
                return await client.get("/broken")

        return asyncio.run(answer())

    return asking


@pytest.mark.parametrize(
    ("kind", "status", "code"),
    [
        (CameraError, 503, "E101"),
        (LightError, 503, "E201"),
        (LoadCellError, 503, "E301"),
        (ModelError, 503, "E401"),
        (StorageError, 507, "E601"),
    ],
)
def test_a_fault_of_a_part_has_its_status_code_cause_and_remedy(ask, kind, status, code):
    answer = ask(kind("It broke.", "Mend it."))
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    body = answer.json()
    assert (body["status"], body["code"], body["detail"], body["remedy"]) == (status, code, "It broke.", "Mend it.")


def test_who_tried_too_often_is_told_when_to_try_again(ask):
    refusal = TooManyTries("192.0.2.7 was wrong 5 times.", "Wait 40 s.")
    refusal.wait_s = 40
    answer = ask(refusal)
    assert (answer.status_code, answer.headers["retry-after"]) == (429, "40")


def test_an_invalid_quantity_is_named_with_value_bound_and_what_to_do(ask):
    answer = ask(InvalidQuantity("press frames", 0, "at least one", "press again"))
    assert answer.status_code == 422
    assert answer.json()["detail"] == "press frames is 0, but must be at least one."
    assert answer.json()["remedy"] == "press again"


def test_an_error_that_nobody_foresaw_tells_the_client_nothing_of_the_inside(ask, caplog):
    answer = ask(ZeroDivisionError("secret detail"))
    assert answer.status_code == 500
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["code"] == "E000"
    assert "secret" not in answer.text
    assert "secret detail" in caplog.text
