"""The steps of the protocol on images whose straight lines are known, and networks whose answers are."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from device.measurement.arrays import Array
from device.simulation.virtual_probe import ProbeTables
from host_tools.replication.networks import Networks
from host_tools.replication.protocol import ProtocolStep, Views, errors, lines, single_trial_percent, views

SLOPE, INTERCEPT = np.array([0.4, 2.0, 1.5]), np.array([0.01, -0.3, 5.0])


@pytest.fixture
def exact() -> Array:
    return np.random.default_rng(1).uniform(1.0, 2.0, (9, 3))


def seen(exact: Array, image: Array | None = None) -> Views:
    """Views whose images lie on the lines deformation = slope image + intercept; a second press is twice as bright."""
    on_lines = (exact - INTERCEPT) / SLOPE
    frames = np.array([on_lines, 2 * on_lines])[:, :, None].repeat(4, axis=2)
    return Views(exact, on_lines if image is None else image, frames)


class Echo:
    """Networks that answer with the features times a factor each."""

    def __init__(self, *factors: float) -> None:
        self.factors = np.array(factors)

    def answers(self, features: Array) -> Array:
        return self.factors[:, None, None] * features


def echoes(*factors: float) -> list[Networks]:
    return [cast(Networks, Echo(*factors))] * 9


def test_lines_are_found_again(exact: Array) -> None:
    on_lines = (exact - INTERCEPT) / SLOPE
    assert lines(on_lines, exact)(np.ones((1, 3))) == pytest.approx((SLOPE + INTERCEPT)[None])


@pytest.mark.parametrize(
    ("step", "shape"), [*((s, (1, 1, 3)) for s in list(ProtocolStep)[:3]), (ProtocolStep.NOISE, (2, 4, 3))]
)
def test_on_straight_lines_no_step_loses_anything(exact: Array, step: ProtocolStep, shape: tuple[int, ...]) -> None:
    given = seen(exact).deformation(step, 4)
    assert given.shape == shape
    assert given == pytest.approx(np.broadcast_to(exact[4], shape))


def test_an_outlier_bends_its_own_line_only_where_it_takes_part(exact: Array) -> None:
    """Refitted, it is read off the others' exact lines; to the letter, the lines come to meet it."""
    image = (exact - INTERCEPT) / SLOPE
    image[4] += 1.0
    given = seen(exact, image)
    off = {
        step: np.abs(given.deformation(step, 4)[0, 0] - exact[4])
        for step in (ProtocolStep.LETTER, ProtocolStep.REFITTED)
    }
    assert off[ProtocolStep.REFITTED] == pytest.approx(SLOPE)
    assert (off[ProtocolStep.LETTER] < 0.95 * SLOPE).all()


def test_the_mean_over_the_trials_is_scored_a_row_a_press(exact: Array) -> None:
    """Networks that are 10 % too high and 10 % too low err by nothing on average, and by 10 % each."""
    table = errors(echoes(1.1, 0.9), seen(exact), exact, ProtocolStep.NOISE)
    assert table.percent.shape == (18, 3)
    assert table.percent == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_array_equal(table.truth[::2], exact)
    assert single_trial_percent(echoes(1.1, 0.9), seen(exact), exact, ProtocolStep.LETTER) == pytest.approx(10.0)


def test_errors_are_those_of_the_right_phantom(exact: Array) -> None:
    networks = [cast(Networks, Echo(1.0 + 0.01 * i, 1.0 + 0.01 * i)) for i in range(9)]
    percent = errors(networks, seen(exact), exact, ProtocolStep.REFITTED).percent
    assert percent == pytest.approx(np.arange(9.0)[:, None].repeat(3, axis=1))


def test_phantoms_are_seen_without_noise_once_and_with_noise_every_press_anew(tables: ProbeTables) -> None:
    truth, exact = np.array([[12.0, 5.0, 100.0]]), np.ones((1, 3))
    found = views(truth, exact, "linear", tables, presses=2)
    assert (found.image.shape, found.frames.shape) == ((1, 3), (2, 1, 10, 3))
    assert not np.any(found.frames[0] == found.frames[1])
    assert found.frames.mean(axis=(0, 2)) == pytest.approx(found.image, rel=0.02)
