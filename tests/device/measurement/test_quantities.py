"""A number outside its bound becomes one sentence: which quantity, its value, the bound, and what to do."""

import math

import pytest

from device.measurement.quantities import UNKNOWNS, Bound, Inclusion, InvalidQuantity, require, unit_of

CLOSED = Bound(0.5, 2.0, "mm")
HALF_OPEN = Bound(0.0, 2.0, "mm", low_included=False)


@pytest.mark.parametrize(("bound", "value"), [(CLOSED, 0.5), (CLOSED, 2.0), (CLOSED, 1), (HALF_OPEN, 5e-324)])
def test_both_ends_of_a_closed_bound_are_inside(bound, value):
    assert require("size_mm", value, bound, "change it") == value


@pytest.mark.parametrize(
    ("bound", "value"),
    [
        (CLOSED, math.nextafter(0.5, 0)),
        (CLOSED, math.nextafter(2.0, 3)),
        (HALF_OPEN, 0.0),
        (HALF_OPEN, -0.0),
        (CLOSED, math.nan),
        (CLOSED, math.inf),
        (CLOSED, -math.inf),
        (Bound(-math.inf, math.inf, ""), math.inf),
        (Bound(-math.inf, math.inf, ""), math.nan),
    ],
)
def test_the_next_number_beyond_an_end_is_refused_and_so_is_what_is_not_finite(bound, value):
    with pytest.raises(InvalidQuantity):
        require("size_mm", value, bound, "change it")


@pytest.mark.parametrize("value", [True, False, "1", None, [1.0], 1j])
def test_what_is_no_number_is_refused_and_a_truth_value_is_no_number(value):
    with pytest.raises(InvalidQuantity, match="must be a number at least 0.5"):
        require("size_mm", value, CLOSED, "change it")


def test_a_whole_number_comes_back_as_a_float():
    assert type(require("size_mm", 1, CLOSED, "change it")) is float


def test_a_refusal_is_one_sentence_with_quantity_value_bound_and_action():
    with pytest.raises(InvalidQuantity) as refusal:
        require("depth_mm", 3, HALF_OPEN, "press elsewhere")
    assert str(refusal.value) == "depth_mm is 3, but must be above 0 and at most 2 mm: press elsewhere."
    error = refusal.value
    assert (error.quantity, error.value, error.bound) == ("depth_mm", 3, "above 0 and at most 2 mm")
    assert error.action == "press elsewhere"


@pytest.mark.parametrize(
    ("bound", "words"),
    [
        (Bound(1.0, math.inf, "us"), "at least 1 us"),
        (Bound(1.0, math.inf, "us", low_included=False), "above 1 us"),
        (Bound(0.0, 1.0, ""), "at least 0 and at most 1"),
        (Bound(-math.inf, 1.5, "counts"), "at most 1.5 counts"),
    ],
)
def test_a_bound_reads_as_words(bound, words):
    assert str(bound) == words


def test_the_unknowns_are_in_the_same_order_everywhere():
    inclusion = Inclusion(size_mm=10.0, depth_mm=5.0, youngs_modulus_kpa=80.0)
    assert inclusion.as_tuple() == tuple(getattr(inclusion, name) for name in UNKNOWNS) == (10.0, 5.0, 80.0)


@pytest.mark.parametrize(
    ("inclusion", "quantity"),
    [
        ((-0.1, 5.0, 80.0), "size_mm"),
        ((100.1, 5.0, 80.0), "size_mm"),
        ((10.0, 0.0, 80.0), "depth_mm"),
        ((10.0, 200.1, 80.0), "depth_mm"),
        ((10.0, 5.0, 0.0), "youngs_modulus_kpa"),
        ((10.0, 5.0, math.nan), "youngs_modulus_kpa"),
    ],
)
def test_an_impossible_inclusion_is_refused_by_the_name_of_what_is_impossible(inclusion, quantity):
    with pytest.raises(InvalidQuantity, match=f"^{quantity} is"):
        Inclusion(*inclusion)


def test_an_inclusion_of_no_size_is_tissue_without_an_inclusion():
    assert Inclusion(0.0, 5.0, 80.0).size_mm == 0.0


@pytest.mark.parametrize(
    ("name", "unit"),
    [("force_n", "N"), ("size_mm", "mm"), ("central_deformation_mm3", "mm3"), ("deformation_area_mm2", "mm2"),
     ("tissue_modulus_std_kpa", "kPa"), ("misfit_ratio", "1"), ("interval_level_percent", "%"), ("contrast_3", "1")],
)  # fmt: skip
def test_a_unit_is_that_of_the_name(name, unit):
    assert unit_of(name) == unit
