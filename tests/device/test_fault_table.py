"""One table of faults: a code cannot be missing or there twice, and every row says all that is shown of it."""

import pytest

from device import errors
from device.errors import PARTS, CameraError, DeviceError
from device.fault_table import FAULTS, FaultCode


def test_every_error_class_is_a_row():
    kinds = {kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, DeviceError)}
    assert {kind.code for kind in kinds} == {fault.code for fault in FAULTS}
    assert len(kinds) == len(FAULTS)


def test_an_error_with_the_code_of_another_cannot_be_written():
    with pytest.raises(TypeError, match="Second has the code E101 of CameraError"):
        type("Second", (CameraError,), {"code": "E101", "title": "Second", "__doc__": "A second one."})
    assert DeviceError.by_code["E101"] is CameraError


@pytest.mark.parametrize("missing", ["code", "title", "__doc__"])
def test_an_error_without_an_entry_of_its_own_cannot_be_written(missing):
    entry = {"code": "E199", "title": "New", "__doc__": "A new one."}
    del entry[missing]
    with pytest.raises(TypeError, match=f"New has no {missing} of its own"):
        type("New", (CameraError,), entry)
    assert "E199" not in DeviceError.by_code


@pytest.mark.parametrize("code", ["E19", "F101", "E1x1", "EA01", "E 99"])
def test_a_code_is_e_and_three_digits_of_a_part(code):
    with pytest.raises(TypeError, match="E and three digits"):
        type("New", (CameraError,), {"code": code, "title": "New", "__doc__": "A new one."})


def test_the_first_digit_is_the_part():
    assert {fault.code: fault.part for fault in FAULTS} == {fault.code: PARTS[fault.code[1]] for fault in FAULTS}
    assert {fault.part for fault in FAULTS} == set(PARTS.values())


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.code)
def test_a_row_has_a_short_title_of_its_own_and_a_sentence(fault):
    assert [other.title for other in FAULTS].count(fault.title) == 1
    assert len(fault.title) <= 32
    assert not fault.title.endswith(".")
    assert fault.meaning.endswith(".")
    assert "\n" not in fault.meaning


def test_only_warnings_last():
    assert {fault.severity for fault in FAULTS if fault.is_lasting} == {"warning"}


def test_the_enumeration_has_every_code():
    assert [code.value for code in FaultCode] == [fault.code for fault in FAULTS]
