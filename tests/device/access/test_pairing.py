"""A code holds once and for minutes, and whoever guesses waits, while nobody else does."""

import pytest

from device.access.pairing import (
    CODE_SIGNS,
    MOST_ADDRESSES,
    SIGNS,
    TRIES_IN_ALL,
    TRIES_OF_ONE,
    TRIES_WITHIN_S,
    VALID_S,
    Pairing,
    TryLimit,
)
from device.errors import TooManyTries, WrongCode

HERE, THERE = "192.0.2.7", "192.0.2.8"


class Clock:
    def __init__(self):
        self.now_s = 1000.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def pairing(clock):
    return Pairing(clock)


def wrong(pairing, address=HERE, code="x"):
    with pytest.raises(WrongCode):
        pairing.claim(code, address)


def test_a_code_is_of_forty_bits_that_nobody_reads_wrong(pairing):
    codes = {pairing.begin("PC", "read", 1).code for _ in range(50)}
    assert len(codes) == 50
    assert all(len(code) == CODE_SIGNS == 8 and set(code) <= set(SIGNS) for code in codes)
    assert len(set(SIGNS)) == 32
    assert not set("01OI") & set(SIGNS)


@pytest.mark.parametrize("typed", [str, str.lower, lambda code: f" {code[:4]} {code[4:]} ", lambda code: f"{code}-"])
def test_it_is_taken_as_people_type_it_and_once(pairing, typed):
    code = pairing.begin("PC", "measure", 30)
    assert pairing.claim(typed(code.shown), HERE) == code
    assert pairing.present() is None
    wrong(pairing, code=code.code)


def test_it_ends_by_itself_by_a_newer_one_and_when_it_is_ended(pairing, clock):
    first = pairing.begin("PC", "read", 1)
    clock.now_s += VALID_S - 1
    assert (pairing.present(), pairing.left_s(first)) == (first, 1.0)
    clock.now_s += 1
    assert pairing.present() is None
    wrong(pairing, code=first.code)
    second = pairing.begin("PC", "read", 1)
    third = pairing.begin("PC", "read", 1)
    wrong(pairing, code=second.code)
    pairing.end()
    wrong(pairing, code=third.code)


def test_without_a_code_every_try_is_wrong_also_an_empty_one(pairing):
    for code in ("", "-", "\x00", "é" * 8):
        with pytest.raises(WrongCode):
            pairing.claim(code, THERE)


def test_who_is_wrong_too_often_waits_even_with_the_right_code_and_nobody_else_does(pairing, clock):
    code = pairing.begin("PC", "read", 1)
    for _ in range(TRIES_OF_ONE):
        wrong(pairing)
    with pytest.raises(TooManyTries, match="Wait 60 s"):
        pairing.claim(code.code, HERE)
    wrong(pairing, THERE)
    clock.now_s += TRIES_WITHIN_S
    assert pairing.claim(code.code, HERE) == code


def test_after_some_tries_in_all_the_code_is_void_from_however_many_addresses(pairing):
    code = pairing.begin("PC", "read", 1)
    for number in range(TRIES_IN_ALL):
        wrong(pairing, f"192.0.2.{number}")
    assert pairing.present() is None
    wrong(pairing, "198.51.100.1", code.code)


def test_a_thousand_guesses_are_twenty_tries(pairing):
    """Each address is let try five times; the code is void after twenty."""
    code = pairing.begin("PC", "read", 1)
    answers = []
    for guess in range(1000):
        try:
            pairing.claim(f"{guess:08d}", f"192.0.2.{guess % 8}")
        except (WrongCode, TooManyTries) as refusal:
            answers.append(type(refusal))
    assert answers.count(WrongCode) == 8 * TRIES_OF_ONE
    wrong(pairing, "198.51.100.1", code.code)


def test_many_addresses_take_no_memory(clock):
    limit = TryLimit(clock)
    for number in range(3 * MOST_ADDRESSES):
        limit.note(str(number))
    assert len(limit._wrong) == MOST_ADDRESSES
