"""The page of limits: what it says follows from the map it is given."""

import numpy as np
import pytest

from host_tools.inverse.information import CramerRao
from host_tools.inverse.limits import Limit, Limits
from host_tools.study.accuracy_figure import draw_map
from host_tools.study.accuracy_map import (
    DEPTHS_MM,
    NOT_SMOOTH,
    SIZES_MM,
    STANDARD,
    MappedScene,
    deepest_mm,
    factors,
    lumps,
    stds,
    ways,
)
from host_tools.study.accuracy_page import FIGURE, limits_markdown, percent

BOX = np.array([0.4, 0.4, 0.8])


def bound(std):
    return CramerRao(np.asarray(std), np.eye(3), np.array([-0.05, 0.05, 1.0]), 1.0)


def fake_limits(lump, factor):
    """Known to depth over size in size and depth, ten times worse in modulus; order 4 a fifth worse for E of 15 kPa."""
    size_mm, depth_mm, modulus_kpa = lump
    std = factor * 0.1 * depth_mm / size_mm * np.array([1.0, 1.0, 10.0])
    finer = std * (1.3 if modulus_kpa == 15 else 1.01)
    orders = {3: std, 4: finer}
    return Limits({order: Limit(bound(s), bound(1 / np.hypot(1 / s, 1 / BOX))) for order, s in orders.items()}, BOX)


@pytest.fixture(scope="module")
def scenes():
    worse = {name: 0.5 if name == NOT_SMOOTH else 1.0 for name in ways()}
    return [MappedScene(lump, {name: fake_limits(lump, f) for name, f in worse.items()}) for lump in lumps()]


@pytest.fixture(scope="module")
def page(scenes):
    return limits_markdown(scenes, "host_tools limits --map --out docs/accuracy.md")


def test_bounds_stand_by_size_depth_and_modulus(scenes):
    found = stds(scenes, STANDARD)
    assert found[2, 1, 2] == pytest.approx(1.01 * 0.06 * np.array([1, 1, 10]))
    assert factors(scenes, NOT_SMOOTH) == pytest.approx(np.full(3, 0.5))


def test_a_depth_counts_down_to_the_first_that_is_not_known():
    assert deepest_mm(np.array([True, True, False, True])) == DEPTHS_MM[1]
    assert deepest_mm(np.ones(4, dtype=bool)) == DEPTHS_MM[-1]
    assert deepest_mm(np.array([False, True, True, True])) is None


@pytest.mark.parametrize(
    ("ratio", "text"), [(0.0123, "1.2"), (0.5, "50"), (0.997, "100"), (1.54, "154"), (12.0, ">1000")]
)
def test_bounds_are_written_to_two_digits_as_far_as_they_mean_anything(ratio, text):
    assert percent(ratio) == text


def test_the_page_names_its_command_and_counts_what_is_known(page, scenes):
    known = int(np.sum(stds(scenes, STANDARD)[..., 0] <= 0.1))
    assert "Written by `host_tools limits --map --out docs/accuracy.md`" in page
    assert f"- **Size**: to 10 % in {known} of 64 scenes" in page
    assert "would be 2 / 2 / 2 times smaller; with four times the frames they are 1 / 1 / 1 times smaller" in page


def test_bold_is_what_the_probe_would_call_identifiable(page, scenes):
    boxed = page.split("Standard, with the box as prior")[1].split("###")[0]
    called = sum(sum(scene.limits[STANDARD].identifiable) for scene in scenes)
    assert 0 < called < 3 * len(scenes)
    assert boxed.count("**") == 2 * called


def test_a_tilde_marks_where_the_orders_differ(page):
    alone = page.split("| Standard, measurement alone")[1].split("| Precise")[0]
    rows = [line for line in alone.splitlines() if " deep |" in line]
    assert len(rows) == len(SIZES_MM) * len(DEPTHS_MM)
    assert all(row.split("|")[2].endswith("~ ") for row in rows)
    assert sum(row.count("~") for row in rows) == len(rows)


def test_the_figure_is_drawn_where_the_page_looks_for_it(page, scenes, tmp_path):
    draw_map(scenes, tmp_path / FIGURE)
    assert f"(figures/{FIGURE})" in page
    assert (tmp_path / FIGURE).stat().st_size > 20_000
