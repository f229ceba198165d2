"""Scores of made-up estimates: the printed errors, skill and coverage are those worked out on paper."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate, EstimateStatus, Quantity
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.recording import Recording
from host_tools.scores.score_recordings import (
    Sample,
    Score,
    ScoredPress,
    print_score,
    score,
    score_record,
    unbounded,
)


def estimate_of(quantities: Sequence[Quantity], status: EstimateStatus = "ok") -> Estimate:
    return Estimate(
        *quantities,
        status=status,
        reason="",
        mode="standard",
        model="demo",
        model_sha256="",
        calibration_id="",
        simulated=True,
        features={},
    )


def quantity(value: float, half_width: float, std: float = 1.0, *, known: bool = True) -> Quantity:
    return Quantity(value, value - half_width, value + half_width, std, known)


REFUSED = estimate_of([UNKNOWN_QUANTITY] * 3, "outside_range")


NO_BOUND = unbounded("standard", Inclusion(10.0, 6.0, 60.0), {})


def scored(truth: Inclusion, estimate: Estimate) -> ScoredPress:
    return ScoredPress(truth, estimate, NO_BOUND)


def of_size(truth_mm: float, answer: Quantity) -> ScoredPress:
    """Return a press whose depth and modulus are answered exactly."""
    others = quantity(6.0, 1.0), quantity(60.0, 5.0)
    return scored(Inclusion(truth_mm, 6.0, 60.0), estimate_of([answer, *others]))


def printed(presses: Sequence[ScoredPress], left_out: int = 0) -> str:
    out = Console(file=io.StringIO(), width=160)
    print_score(Score(tuple(presses), left_out), out)
    return out.file.getvalue()


def row(text: str, name: str) -> list[str]:
    """Return the cells of the table's row of a name."""
    line = next(line for line in text.splitlines() if name in line)
    return [cell.strip() for cell in line.strip("│┃ ").split("│")][1:]


FOUR = [
    of_size(10.0, quantity(11.0, 2.0)),  # 10 %, inside
    of_size(10.0, quantity(8.0, 1.0)),  # 20 %, outside
    of_size(20.0, quantity(20.0, 1.0)),  # 0 %, inside
    of_size(20.0, quantity(22.0, 9.0, known=False)),  # 10 %, inside, but not determined
]


def test_errors_are_percent_of_the_truth_by_mean_deviation_and_extremes():
    text = printed(FOUR)
    assert row(text, "mean error") == ["10.00 %", "0.00 %", "0.00 %"]
    assert row(text, "standard deviation")[0] == f"{np.sqrt(50):.2f} %"
    assert row(text, "smallest error")[0] == "0.00 %"
    assert row(text, "largest error")[0] == "20.00 %"


def test_coverage_counts_the_determined_ones_alone():
    text = printed(FOUR)
    assert row(text, "determined")[0] == "75.0%"
    assert row(text, "truth inside") == ["66.7% of 3", "100.0% of 4", "100.0% of 4"]


def test_where_nothing_is_determined_there_is_no_coverage():
    assert row(printed([of_size(10.0, quantity(10.0, 9.0, known=False))]), "truth inside")[0] == "-"


def test_skill_is_against_the_middle_of_the_truths():
    """Root mean square error sqrt(9 / 4), of the middle 5 mm; depths are all the same, so there is none."""
    found = row(printed(FOUR), "skill")
    assert found == ["0.70", "nan", "nan"]


def test_error_over_spread_is_1_for_a_spread_as_large_as_the_error():
    off = [of_size(10.0, quantity(10.0 + sign * 0.3, 1.0, std=0.3)) for sign in (-1, 1)]
    twice = [of_size(10.0, quantity(10.0 + sign * 0.3, 1.0, std=0.15)) for sign in (-1, 1)]
    assert [row(printed(presses), "error / stated")[0] for presses in (off, twice)] == ["1.00", "2.00"]


def test_presses_without_numbers_are_counted_by_status_but_have_no_error():
    text = printed([*FOUR, scored(Inclusion(10.0, 6.0, 60.0), REFUSED)])
    assert text.startswith("5 presses of mode standard, simulated: 4 ok, 1 outside_range\n")
    assert "4 answered presses" in text
    assert row(text, "mean error")[0] == "10.00 %"


def test_each_mode_and_real_presses_have_a_table_of_their_own():
    """Errors of 10, 20, 0 and 10 % in one mode, of 50 % in another, and one of 20 % that is real."""
    other = of_size(10.0, quantity(15.0, 1.0))
    quick = replace(other, estimate=replace(other.estimate, mode="quick"))
    off = of_size(10.0, quantity(12.0, 1.0))
    real = replace(off, estimate=replace(off.estimate, simulated=False))
    presses = [*FOUR[:2], quick, real, *FOUR[2:]]
    text = printed(presses, left_out=1)
    lines = [line for line in text.splitlines() if " presses of " in line]
    assert lines == [
        "4 presses of mode standard, simulated: 4 ok",
        "1 presses of mode quick, simulated: 1 ok",
        "1 presses of mode standard, real: 1 ok",
    ]
    means = [line.split("│")[2].strip() for line in text.splitlines() if "mean error  " in line]
    assert means == ["10.00 %", "50.00 %", "20.00 %"]
    assert text.splitlines()[-1] == "1 left out"
    record = score_record(Score(tuple(presses), 1))
    assert (record["presses"], record["left_out"], record["answered"], record["status"]) == (6, 1, 6, {"ok": 6})
    assert (record["unknowns"], record["all_mean_percent"]) == (None, None)
    assert [(one["mode"], one["simulated"], one["presses"]) for one in record["groups"]] == [
        ("standard", True, 4),
        ("quick", True, 1),
        ("standard", False, 1),
    ]
    sizes = [one["unknowns"]["size_mm"]["mean_percent"] for one in record["groups"]]
    assert sizes == pytest.approx([10.0, 50.0, 20.0])


def test_the_numbers_of_the_only_group_stand_beside_the_counts():
    record = score_record(Score(tuple(FOUR)))
    [group] = record["groups"]
    for name in ("presses", "status", "answered", "unknowns", "all_mean_percent"):
        assert record[name] == group[name]


def test_refused_presses_count_as_the_middle_of_the_ranges_among_all():
    """Sizes of 10 mm: one answered 11, one refused and guessed 8.5; 6 mm deep, 60 kPa, guessed 8 and 40."""
    refused = scored(Inclusion(10.0, 6.0, 60.0), REFUSED)
    presses = [of_size(10.0, quantity(11.0, 2.0)), refused]
    assert row(printed(presses), "mean error of all, others guessed") == ["12.50 %", "16.67 %", "16.67 %"]
    assert row(printed(presses), "mean error")[0] == "10.00 %"
    record = score_record(Score(tuple(presses)))
    assert record["all_mean_percent"]["size_mm"] == pytest.approx(12.5)
    assert record["unknowns"]["size_mm"]["mean_percent"] == pytest.approx(10.0)


def test_of_refused_presses_only_there_is_nothing_to_tabulate():
    text = printed([scored(Inclusion(10.0, 6.0, 60.0), REFUSED)] * 2)
    assert text.strip() == "2 presses of mode standard, simulated: 2 outside_range"


def test_octiles_hold_an_eighth_of_the_truths_each_with_their_own_error_and_coverage():
    """80 sizes from 1 to 80; the last ten are answered half as large as they are, all others exactly."""
    presses = [
        replace_unknowns(of_size(truth, quantity(truth * (0.5 if truth > 70 else 1.0), 0.1)), truth)
        for truth in np.arange(1.0, 81.0)
    ]
    text = printed(presses)
    first, last = row(text, "size 1"), row(text, "size 8")
    assert first[-3:] == ["0.00 %", "100%", "100.0% of 10"]
    assert last == ["70.1", "80", "50.00 %", "100%", "0.0% of 10"]


def replace_unknowns(press: ScoredPress, number: float) -> ScoredPress:
    """Return the press with depth and modulus of its own, answered exactly."""
    truth = replace(press.truth, depth_mm=number, youngs_modulus_kpa=number)
    exact = quantity(number, 1.0)
    return scored(truth, replace(press.estimate, depth_mm=exact, youngs_modulus_kpa=exact))


def test_fewer_than_five_presses_an_octile_are_not_split():
    presses = [replace_unknowns(of_size(truth, quantity(truth, 1.0)), truth) for truth in np.arange(1.0, 41.0)]
    assert "size 8" in printed(presses)
    assert "size 8" not in printed(presses[:-1])


def test_nothing_to_score_is_refused():
    with pytest.raises(InvalidQuantity, match="^presses with truth is 0, but must be at least one"):
        print_score(Score((), 2), Console(file=io.StringIO()))


def test_what_is_left_out_is_counted_at_the_end():
    assert printed(FOUR, left_out=2).endswith("\n2 left out\n")
    assert "left out" not in printed(FOUR)


def test_recordings_without_truth_or_that_cannot_be_read_are_named_and_left_out(recording: Recording):
    heard: list[str] = []
    nameless = replace(recording, truth=None)
    short, another = replace(recording, frames=recording.frames[:1]), replace(recording, frames=recording.frames[:-1])

    def damaged() -> Recording:
        raise InvalidQuantity("size_mm", np.nan, "at least 0 mm", "correct it")

    def estimate(one: Recording) -> Estimate:
        if one is short:
            raise InvalidQuantity("press frames", 0, "at least 6", "press again")
        assert one.truth is not None
        return REFUSED

    samples = [
        Sample("first", lambda: recording),
        Sample("nameless", lambda: nameless),
        Sample("damaged", damaged),
        Sample("short", lambda: short),
        Sample("first with another name", lambda: replace(recording, id="r-2", started_at="2027-01-01T00:00:00Z")),
        Sample("last", lambda: another),
    ]
    found = score(samples, estimate, heard.append)
    assert [press.truth for press in found.presses] == [recording.truth] * 2
    assert all(press.estimate is REFUSED for press in found.presses)
    assert found.left_out == 4
    assert heard == [
        "nameless is left out: truth is missing, but must be that of a phantom: score recordings of phantoms.",
        "damaged is left out: size_mm is nan, but must be at least 0 mm: correct it.",
        "short is left out: press frames is 0, but must be at least 6: press again.",
        "first with another name is left out: it is the recording first again",
    ]


def test_each_unknown_is_scored_against_its_own_truth():
    """Answers 10, 20 and 30 % too large."""
    answers = [quantity(10.0 * factor, 5.0) for factor in (1.1, 1.2, 1.3)]
    text = printed([scored(Inclusion(10.0, 10.0, 10.0), estimate_of(answers))])
    assert row(text, "mean error") == ["10.00 %", "20.00 %", "30.00 %"]


BOUND = np.array([0.05, 0.1, 0.4])


def bounded(size_mm: float, least_errors: np.ndarray = BOUND) -> ScoredPress:
    """Return a press of 8.5 mm, 8 mm deep, 40 kPa, the middle of all ranges, that is answered as of another size."""
    middle = Inclusion(8.5, 8.0, 40.0)
    answers = quantity(size_mm, 1.0), quantity(8.4, 1.0), quantity(80.0, 9.0, known=False)
    return ScoredPress(middle, estimate_of(answers), least_errors)


def test_errors_are_compared_with_the_bound_in_coordinates():
    """6.5 mm of size, 4 mm of depth and a factor 4 of modulus are one: errors of 0.1, 0.1 and ln 2 / ln 4."""
    text = printed([bounded(8.5 + 0.65), bounded(8.5 - 0.65)])
    assert row(text, "RMS error, range as -1 to 1") == ["0.100", "0.100", "0.500"]
    assert row(text, "least RMS error (bound)") == ["0.050", "0.100", "0.400"]
    assert row(text, "RMS error / bound") == ["2.00", "1.00", "1.25"]


def test_errors_and_bounds_are_root_mean_squares_of_all_presses():
    """Errors 0 and 0.1, bounds 0.05 and 0.15: 0.0707 over 0.1118."""
    text = printed([bounded(8.5), bounded(8.5 + 0.65, 3 * BOUND)])
    assert row(text, "RMS error, range as -1 to 1")[0] == "0.071"
    assert row(text, "least RMS error (bound)")[0] == "0.112"
    assert row(text, "RMS error / bound")[0] == "0.63"


def test_presses_without_a_bound_are_not_compared_with_one():
    text = printed([bounded(8.5 + 0.65), bounded(2.0, NO_BOUND), bounded(2.0, NO_BOUND)])
    assert row(text, "RMS error / bound, 1 of 3")[0] == "2.00"
    assert "bound" not in printed(FOUR)


def test_octiles_have_their_own_error_over_bound():
    """Of 80 sizes the last ten alone are answered 0.65 mm, twice the bound, too large."""
    sizes = np.linspace(3.0, 14.0, 80)
    presses = []
    for number, size in enumerate(sizes):
        said = quantity(size + (0.65 if number >= 70 else 0.0), 1.0)
        estimate = replace(bounded(8.5).estimate, size_mm=said)
        presses.append(ScoredPress(Inclusion(size, 8.0, 40.0), estimate, BOUND))
    text = printed(presses)
    assert [row(text, f"size {octile}")[-1] for octile in (1, 7, 8)] == ["0.00", "0.00", "2.00"]


def test_the_bound_is_of_the_mode_that_answered_and_of_the_nuisances_that_are_known(recording: Recording):
    asked = []

    def least_errors(mode: str, truth: Inclusion, nuisances: Mapping[str, float]) -> np.ndarray:
        asked.append((mode, truth, nuisances))
        return BOUND

    samples = [Sample("random", lambda: recording, {"albedo": 0.45})]
    found = score(samples, lambda one: estimate_of([quantity(10.0, 1.0)] * 3), least_errors=least_errors)
    assert asked == [("standard", recording.truth, {"albedo": 0.45})]
    assert found.presses[0].least_errors is BOUND
