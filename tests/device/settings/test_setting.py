"""A setting is checked by what it carries; a section tells all that is wrong with it, not only the first."""

from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from device.measurement.quantities import Bound, InvalidQuantity
from device.settings.setting import Conflict, InvalidSettings, Section, conflict, setting


@dataclass(frozen=True)
class Tank(Section):
    prefix = "tank."

    level_mm: float = setting(20.0, "Height of the water.", Bound(1.0, 100.0, "mm"))
    height_mm: float = setting(50.0, "Height of the wall.", Bound(10.0, 200.0, "mm"))
    shape: str = setting("round", "Seen from above.", choices=("round", "square"))
    taps_mm: tuple[float, ...] | None = setting(None, "Heights of the taps.", Bound(0.0, 90.0, "mm"), count=2)

    def conflicts(self) -> Iterator[InvalidQuantity]:
        yield from conflict("tank.level_mm", self.level_mm, Bound(1.0, self.height_mm, "mm"), "tank.height_mm")


def problems_of(**values):
    with pytest.raises(InvalidSettings) as refusal:
        Tank(**values)
    return refusal.value.problems


def test_the_default_is_the_fields_own():
    assert Tank() == Tank(20.0, 50.0, "round", None)


def test_everything_wrong_in_a_section_is_told_at_once():
    problems = problems_of(level_mm=0.5, height_mm=201.0, shape="oval", taps_mm=(1.0,))
    assert [problem.quantity for problem in problems] == [
        "tank.level_mm", "tank.height_mm", "tank.shape", "tank.taps_mm",
    ]  # fmt: skip


def test_the_refusal_has_a_line_for_each_problem_and_begins_with_the_first():
    with pytest.raises(InvalidQuantity) as refusal:
        Tank(level_mm=0.5, shape="oval")
    assert refusal.value.quantity == "tank.level_mm"
    assert str(refusal.value).splitlines() == [
        "tank.level_mm is 0.5, but must be at least 1 and at most 100 mm: correct the setting.",
        "tank.shape is 'oval', but must be one of round, square: correct the setting.",
    ]


def test_each_number_of_a_list_has_to_hold():
    assert [problem.value for problem in problems_of(taps_mm=(-1.0, 91.0))] == [-1.0, 91.0]


@pytest.mark.parametrize("taps_mm", [(0.0, 90.0), None])
def test_a_list_within_its_bound_or_not_set_is_taken(taps_mm):
    assert Tank(taps_mm=taps_mm).taps_mm == taps_mm


def test_what_does_not_fit_together_names_the_setting_and_those_it_has_to_fit():
    [problem] = problems_of(level_mm=60.0)
    assert isinstance(problem, Conflict)
    assert problem.others == ("tank.height_mm",)
    assert str(problem).endswith("at most 50 mm: correct it or tank.height_mm.")


def test_what_does_not_fit_together_may_say_better_what_to_do():
    assert str(Conflict("tank.level_mm", 60, "below the wall", ("tank.height_mm",), "drain it")) == (
        "tank.level_mm is 60, but must be below the wall: drain it."
    )


def test_settings_that_do_not_hold_alone_are_not_compared():
    [problem] = problems_of(height_mm=5.0)
    assert problem.quantity == "tank.height_mm"
