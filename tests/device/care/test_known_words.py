"""Of a free text only what can be the program's own is let through."""

from __future__ import annotations

import pytest

from device.care.known_words import known_in, known_only


@pytest.mark.parametrize(
    "text",
    [
        "E101 No frame came within 1 s. Check the camera's cable.",
        "ERROR device.instrument.procedure: E201 LED chip 0x60 does not answer.",
        "tsis.service: Main process exited, code=killed, status=9/KILL",
        "tsis.service: Watchdog timeout (limit 15s)!",
        "database disk image is malformed",
        "Permission denied",
    ],
)
def test_the_programs_own_sentences_are_told_whole(text: str) -> None:
    assert known_only(text).replace("[...]", "") == text


@pytest.mark.parametrize(
    "secret",
    ["Mustermann", "Müller", "1964-08-12", "12.08.1964", "12/8/64", "MRN-00471108", "4711", "+49-30-123456",
     "3f0c2d1e-9a7b-4c55-8e21-000000000000", "erika@example.org", "/home/erika", "10.3.44.7"],
)  # fmt: skip
def test_names_dates_numbers_and_addresses_are_held_back(secret: str) -> None:
    assert known_only(f"The probe {secret} is ready") == "The probe [...] is ready"
    assert secret not in str(known_in({secret: [secret, {"reason": secret}]}))


def test_of_a_traceback_the_place_in_the_program_is_told_and_not_what_was_in_it() -> None:
    text = (
        "Traceback (most recent call last):\n"
        '  File "/opt/tsis/releases/0.2.0+41/lib/python3.11/site-packages/device/web/app.py", line 155, in screen\n'
        '    raise ValueError("Erika")\n'
        '  File "/home/erika/x.py", line 3, in erika\n'
        "ValueError: Erika"
    )
    assert known_only(text).splitlines() == [
        "Traceback (most recent call last):",
        "  device/web/app.py:155 screen",
        "raise [...]",
        "  in a library",
        "ValueError: [...]",
    ]


def test_a_release_and_a_time_stay_in_a_record_and_a_number_stays_a_number() -> None:
    record = {"committed": "0.2.0+412", "bad": {"0.1.9+400": "Erika"}, "at": "2026-11-22T10:00:00Z", "tries": 4711}
    assert known_in(record) == {**record, "bad": {"0.1.9+400": "[...]"}}


def test_several_words_that_are_held_back_are_one_gap() -> None:
    assert known_only("The probe Erika Mustermann 12.08.1964 is ready") == "The probe [...] is ready"
