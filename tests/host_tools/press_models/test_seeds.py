"""Seeds of purposes and presses."""

from __future__ import annotations

from itertools import product

from host_tools.press_models.seeds import PRESSES, derived_seed, press_seed


def test_no_purpose_shares_a_seed_with_another_purpose_or_another_seed():
    drawn = [derived_seed(*one) for one in product(range(200), ("pool", "bands", "recordings", "dial"))]
    assert len(set(drawn)) == len(drawn)


def test_presses_of_neighbouring_purposes_do_not_overlap():
    assert press_seed(3, PRESSES - 1) < press_seed(4, 0)


def test_a_seed_is_the_same_in_every_run():
    assert derived_seed(1, "pool") == derived_seed(1, "pool") != derived_seed(1, "pools")
