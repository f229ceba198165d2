"""What a forward model lacks of a probe: how large it is of a row, and what it moves."""

import numpy as np
import pytest

from device.measurement.parameters import PARAMETERS
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.commissioned.discrepancy import (
    KNOWN_BY,
    NOTHING,
    PARTS,
    PROBES,
    Discrepancy,
    error_sizes,
)
from device.measurement.ramp_modes.radial_profile import COLUMNS, CONTRAST, FIRST, RESPONSE, SECOND


@pytest.fixture(scope="module")
def rows():
    return np.random.default_rng(1).uniform(0.01, 0.2, (3, COLUMNS))


def test_without_an_inclusion_only_the_reference_response_can_be_wrong(rows):
    alone = np.array(rows)
    for columns in (CONTRAST, FIRST, SECOND):
        alone[:, columns] = 0.0
    sizes = error_sizes(alone)
    assert np.all(sizes[:, RESPONSE] == 1)
    assert np.count_nonzero(sizes) == 3 * (RESPONSE.stop - RESPONSE.start)


def test_an_error_is_as_large_as_the_inclusions_effect_and_goes_on_where_that_changes_its_sign(rows):
    sizes = error_sizes(np.full_like(rows, -0.1))
    assert sizes[:, CONTRAST] == pytest.approx(0.1)
    crossing = np.full_like(rows, 0.1)
    crossing[:, 5] = 0.0
    assert 0.05 < error_sizes(crossing)[0, 5] < 0.1


def test_it_moves_rows_evenly_with_skin_and_tissue(rows):
    """A mean of 1 % everywhere, and 2 % more for each of the spread's coordinate."""
    mean = np.zeros((PARTS, COLUMNS))
    mean[0], mean[1 + KNOWN_BY.index(PARAMETERS.index("spread_mm"))] = 0.01, 0.02
    lacking = Discrepancy(mean, NOTHING.factor, NOTHING.of_probe)
    at = np.zeros((3, len(PARAMETERS)))
    at[:, PARAMETERS.index("spread_mm")] = -1, 0, 1
    assert lacking.shift(at, rows) == pytest.approx(np.array([[-0.01], [0.01], [0.03]]) * error_sizes(rows))


def test_its_spread_is_a_factor_of_what_it_may_move(rows):
    factor = np.zeros((PARTS, COLUMNS, 2))
    factor[0, :, 0], factor[1, :, 1] = 0.03, 0.04
    lacking = Discrepancy(np.zeros((PARTS, COLUMNS)), factor, np.zeros((PROBES, 2)))
    at = np.zeros((3, len(PARAMETERS)))
    at[2, KNOWN_BY[0]] = 1.0
    std = np.linalg.norm(lacking.spread(at, rows), axis=2)
    assert std == pytest.approx(np.array([[0.03], [0.03], [0.05]]) * error_sizes(rows))


def test_parts_of_other_shapes_are_refused():
    with pytest.raises(InvalidQuantity, match="discrepancy's factor"):
        Discrepancy(NOTHING.mean, np.zeros((PARTS, COLUMNS + 1, 0)), NOTHING.of_probe)
