"""How far presses agree, against numbers computed by hand and by NumPy, and what too few do not tell."""

import numpy as np
import pytest

from device.measurement.quantities import UNKNOWNS
from device.measurement.repeats import Repeats, repeats_by_unknown, repeats_of

MADE_BY = {"mode": "standard", "model_sha256": "a1" * 32, "model_card_sha256": "b2" * 32, "simulated": False}


def test_the_index_is_the_repeatability_coefficient_over_the_mean():
    found = repeats_of([9.0, 10.0, 11.0])
    assert (found.presses, found.mean, found.spread) == (3, 10.0, 1.0)
    assert found.repeatability_index == pytest.approx(0.2772, abs=1e-4)


def test_two_presses_differ_by_less_than_it_says_in_nineteen_of_twenty_cases():
    rng = np.random.default_rng(1)
    presses = rng.normal(80.0, 4.0, 20_000)
    apart = np.abs(presses[::2] - presses[1::2])
    within = apart < repeats_of(list(presses)).repeatability_index * 80.0
    assert within.mean() == pytest.approx(0.95, abs=0.01)


def test_too_few_presses_tell_no_spread():
    assert repeats_of([]) == Repeats(0, None, None, None)
    assert repeats_of([8.0]) == Repeats(1, 8.0, None, None)
    assert repeats_of([8.0, 8.0]) == Repeats(2, 8.0, 0.0, 0.0)


def test_only_presses_that_determine_an_unknown_count_for_it():
    known, half, none = ({"value": value, "identifiable": is_} for value, is_ in ((8, True), (9, False), (None, False)))
    estimates = [
        MADE_BY | {"size_mm": known, "depth_mm": half, "youngs_modulus_kpa": none},
        MADE_BY | {"size_mm": known, "depth_mm": known, "youngs_modulus_kpa": none},
    ]
    found = repeats_by_unknown(estimates)
    assert [one.presses for one in found.values()] == [2, 1, 0]


@pytest.mark.parametrize(
    "other",
    [
        {"mode": "quick"},
        {"model_card_sha256": "c3" * 32},
        {"model_card_sha256": "", "model_sha256": "c3" * 32},
        {"simulated": True},
    ],
)
def test_presses_of_several_methods_have_neither_mean_nor_spread_nor_index(other):
    value = {"value": 8.0, "identifiable": True}
    estimates = [dict.fromkeys(UNKNOWNS, value) | MADE_BY | made_by for made_by in ({}, other)]
    assert set(repeats_by_unknown(estimates).values()) == {Repeats(2, None, None, None)}
    assert repeats_by_unknown(estimates[:1] * 2)["size_mm"] == Repeats(2, 8.0, 0.0, 0.0)


def test_presses_of_before_there_were_cards_are_of_one_model_where_their_network_is_one():
    value = {"value": 8.0, "identifiable": True}
    estimate = dict.fromkeys(UNKNOWNS, value) | {name: MADE_BY[name] for name in ("mode", "model_sha256", "simulated")}
    assert repeats_by_unknown([estimate, estimate | {"model_card_sha256": ""}])["size_mm"].mean == 8.0


@pytest.mark.parametrize("end", ["low_is_open", "high_is_open"])
def test_no_mean_is_made_while_a_press_has_an_open_end(end):
    closed = {"value": 13.0, "identifiable": True, "low_is_open": False, "high_is_open": False}
    estimates = [dict.fromkeys(UNKNOWNS, one) | MADE_BY for one in (closed, closed, closed | {end: True})]
    assert set(repeats_by_unknown(estimates).values()) == {Repeats(3, None, None, None, open_presses=1)}
    assert repeats_by_unknown(estimates[2:])["size_mm"] == Repeats(1, None, None, None, open_presses=1)
