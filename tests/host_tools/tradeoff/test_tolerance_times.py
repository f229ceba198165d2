"""A tighter tolerance takes a higher order, and what is stated is within it."""

from host_tools.tradeoff.tolerance_times import SHORT, tolerances_chapter


def test_every_tolerance_has_its_time_and_states_no_more_than_it():
    found = tolerances_chapter(SHORT)
    assert found.passed
    assert [one.case for one in found.benchmarks] == ["small strain, 5 %", "small strain, 0.2 %"]
    assert {(family, name) for _, family, name, *_ in found.tables[0].rows} == {
        ("asked for", "graded 3"),
        ("stated", "graded 3"),
        ("asked for", "graded 4"),
        ("stated", "graded 4"),
    }
    assert found.figures[0].name == "tradeoff_tolerances.svg"
