"""The OpenAPI schema: codes are an enumeration of the table of faults, wherever an answer may carry one."""

import types

import pytest

from device.errors import LightError
from device.fault_table import FAULTS
from device.instrument.press.states import PressState
from device.instrument.status import PressJob
from device.web.app import create_app
from device.web.schema import PressResource

CODES = "#/components/schemas/FaultCode"


@pytest.fixture(scope="module")
def schema():
    return create_app(types.SimpleNamespace(), types.SimpleNamespace()).openapi()


def test_the_enumeration_is_the_table(schema):
    assert schema["components"]["schemas"]["FaultCode"]["x-extensible-enum"] == [fault.code for fault in FAULTS]


def test_the_codes_of_faults_and_presses_are_of_the_enumeration(schema):
    models = schema["components"]["schemas"]
    assert models["Fault"]["properties"]["code"]["$ref"] == CODES
    assert models["PressResource"]["properties"]["code"]["anyOf"] == [{"$ref": CODES}, {"type": "null"}]
    assert models["Status"]["properties"]["faults"]["items"]["$ref"] == "#/components/schemas/Fault"


def test_the_states_of_a_press_are_an_enumeration(schema):
    models = schema["components"]["schemas"]
    assert models["PressStateCode"]["x-extensible-enum"] == [state.code for state in PressState]
    assert models["Status"]["properties"]["press_state"]["$ref"] == "#/components/schemas/PressStateCode"


def test_a_problem_has_a_code_of_the_enumeration_and_says_who_holds_a_busy_probe(schema):
    problem = schema["components"]["schemas"]["Problem"]["properties"]
    assert problem["code"]["$ref"] == CODES
    assert problem["holder"]["anyOf"] == [{"$ref": "#/components/schemas/Holder"}, {"type": "null"}]


def test_a_press_is_as_described_and_an_unknown_code_is_not():
    warning = LightError("It broke.", "Mend it.").as_record()
    record = PressJob("p-1", "paper", state="failed", code="E201", warnings=(warning,)).as_record()
    assert PressResource.model_validate(record).code == "E201"
    with pytest.raises(ValueError, match="code"):
        PressResource.model_validate(record | {"code": "E999"})
