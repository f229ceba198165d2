"""The page of limits: what it says follows from the map it is given."""

from datetime import date

import numpy as np
import pytest

from device import __version__
from host_tools.cramer_rao.accuracy_figure import draw_map
from host_tools.cramer_rao.accuracy_map import (
    DEPTHS_MM,
    MODULI_KPA,
    NOT_SMOOTH,
    SIZES_MM,
    STANDARD,
    MappedScene,
    deepest_mm,
    factors,
    inclusions,
    stds,
    ways,
)
from host_tools.cramer_rao.accuracy_page import FIGURE, accuracy_facts
from host_tools.cramer_rao.bounds import Limit, Limits
from host_tools.cramer_rao.information import CramerRao
from host_tools.cramer_rao.press_bound import OFFSETS_MM
from host_tools.pages.page import Results, write_page

BOX = np.array([0.4, 0.4, 0.8])
PAIRS = len(SIZES_MM) * len(DEPTHS_MM)
RATIOS = np.linspace(0.5, 1.5, PAIRS)[:, None] * np.ones(len(MODULI_KPA))
BESIDE = np.linspace(0.9, 0.6, len(OFFSETS_MM))[:, None, None] * RATIOS
APART, BLIND = "pressure itself", "three scalars, largest load only"


def bound(std):
    return CramerRao(np.asarray(std), np.eye(3), np.array([-0.05, 0.05, 1.0]), 1.0)


def fake_limits(inclusion, factor):
    """Known to depth over size in size and depth, ten times worse in modulus.

    Order 4 is 1.3 times as bad for E of 15 kPa, and everywhere for a factor of 2.
    """
    size_mm, depth_mm, modulus_kpa = inclusion
    std = factor * 0.1 * depth_mm / size_mm * np.array([1.0, 1.0, 10.0])
    finer = std * (1.3 if modulus_kpa == 15 or factor == 2.0 else 1.01)
    orders = {3: std, 4: finer}
    return Limits({order: Limit(bound(s), bound(1 / np.hypot(1 / s, 1 / BOX))) for order, s in orders.items()}, BOX)


@pytest.fixture(scope="module")
def scenes():
    worse = dict.fromkeys(ways(), 1.0) | {NOT_SMOOTH: 0.05, APART: 2.0, BLIND: 30.0}
    return [
        MappedScene(inclusion, {name: fake_limits(inclusion, f) for name, f in worse.items()})
        for inclusion in inclusions()
    ]


@pytest.fixture(scope="module")
def page(scenes, tmp_path_factory):
    path = tmp_path_factory.mktemp("docs") / "accuracy.md"
    command = "host_tools limits --map --out docs/accuracy.md"
    write_page(path, Results("accuracy", command, facts=accuracy_facts(scenes, BESIDE)))
    return path.read_text()


def test_bounds_stand_by_size_depth_and_modulus(scenes):
    found = stds(scenes, STANDARD)
    assert found[2, 1, 2] == pytest.approx(1.01 * 0.06 * np.array([1, 1, 10]))
    assert factors(scenes, NOT_SMOOTH) == pytest.approx(np.full(3, 0.05))


def test_a_depth_counts_down_to_the_first_that_is_not_known():
    assert deepest_mm(np.array([True, True, False, True])) == DEPTHS_MM[1]
    assert deepest_mm(np.ones(4, dtype=bool)) == DEPTHS_MM[-1]
    assert deepest_mm(np.array([False, True, True, True])) is None


def test_the_page_names_its_command_and_counts_what_is_known(page, scenes):
    known = int(np.sum(stds(scenes, STANDARD)[..., 0] <= 0.1))
    command = "host_tools limits --map --out docs/accuracy.md"
    assert f"Measured by `{command}`, software {__version__}, {date.today()}." in page.splitlines()
    assert f"- **Size**: to 10 % in {known} of 64 scenes" in page
    assert "would be 20 / 20 / 20 times smaller. With four times the frames they are 1 / 1 / 1 times smaller" in page
    assert f"| {BLIND} | >10 | >10 | >10 |" in page


def test_bold_is_what_the_probe_would_call_identifiable(page, scenes):
    boxed = page.split("| Standard, with the box as prior")[1].split("###")[0]
    called = sum(sum(scene.limits[STANDARD].identifiable) for scene in scenes)
    assert 0 < called < 3 * len(scenes)
    assert boxed.count("**") == 2 * called


def test_a_tilde_marks_where_the_orders_differ(page):
    alone = page.split("| Standard, measurement alone")[1].split("| Precise")[0]
    rows = [line for line in alone.splitlines() if " deep |" in line]
    assert len(rows) == PAIRS
    assert all(row.split("|")[2].endswith("~ ") for row in rows)
    assert sum(row.count("~") for row in rows) == len(rows)


def test_scenes_whose_orders_differ_show_both_beside_each_other(page):
    rows = page.split("### Where the orders are apart")[1].split("###")[0].splitlines()
    assert sum(row.startswith("| standard, ") for row in rows) == PAIRS
    assert "| standard, 10 mm, 6 mm deep, 15 kPa | 6 | 7.8 | 6 | 7.8 | 60 | 78 |" in rows


def test_a_way_whose_orders_are_apart_in_most_scenes_is_no_result(page):
    rows = page.split("### Ways to measure, compared")[1].split("###")[0].splitlines()
    cells = {row.split("|")[1].strip(): row.split("|")[2:-1] for row in rows if row.startswith("| ")}
    assert cells[APART][-1] == " 64 "
    assert all(cell.startswith(" (") and cell.endswith(") ") for cell in cells[APART][:-1])
    assert not any("(" in cell for cell in cells[STANDARD])


def test_what_is_not_bold_is_not_said_to_be_beyond_every_method(page):
    determined = page.split("### The modulus, with the ends of the box")[1].split("###")[0]
    assert sum(" deep |" in line for line in determined.splitlines()) == PAIRS
    assert "leaves 60-160 kPa: 35 % of the box's spread" in determined
    assert "0.60 times as wide" in determined
    assert "by any method" not in page


def test_the_table_beside_the_axis_holds_the_ratios_it_is_given(page):
    rows = page.split("### The modulus, beside the axis")[1].split("###")[0].splitlines()
    assert f"| {OFFSETS_MM[0]:g} mm |{' 0.45 / 0.90 / 1.35 |' * len(MODULI_KPA)}" in rows
    assert f"| {OFFSETS_MM[-1]:g} mm |{' 0.30 / 0.60 / 0.90 |' * len(MODULI_KPA)}" in rows


def test_the_figure_is_drawn_where_the_page_looks_for_it(page, scenes, tmp_path):
    draw_map(scenes, tmp_path / FIGURE)
    assert f"(figures/{FIGURE})" in page
    assert (tmp_path / FIGURE).stat().st_size > 20_000
