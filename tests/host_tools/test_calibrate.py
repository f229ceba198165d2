"""Regressions with known answers, and a certificate from simulated phantoms."""

import numpy as np
import pytest

from device.measurement.estimate import image_features
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.scenario import Scenario
from host_tools.calibrate import calibrate, fit_line, scaled_errors, table_features
from host_tools.forward.solve import solve
from host_tools.phantom import Protocol, phantom_recording
from host_tools.scene import Press, Scene

LINEAR = Scenario(light="linear")
DESIGNS = [(14.0, 4.5, 110.0), (12.0, 7.0, 60.0), (9.0, 5.0, 80.0), (11.0, 9.0, 100.0), (7.0, 6.0, 50.0)]


@pytest.fixture(scope="module")
def recordings(tables):
    """In the paper's light, for which its lines are made."""
    return [
        phantom_recording(Inclusion(*d), tables, seed=i, protocol=Protocol(frames=3), scenario=LINEAR)
        for i, d in enumerate(DESIGNS)
    ]


def test_a_line_through_exact_points_is_that_line():
    line, residuals = fit_line(np.array([0.0, 1.0, 2.0, 5.0]), np.array([1.0, 3.0, 5.0, 11.0]))
    assert (line.slope, line.intercept) == (pytest.approx(2.0), pytest.approx(1.0))
    assert line.r_squared == pytest.approx(1.0)
    np.testing.assert_allclose(residuals, 0.0, atol=1e-12)


def test_leave_one_out_residuals_are_those_of_lines_fitted_without_the_point():
    """e_i / (1 - h_ii) equals y_i minus the prediction of the line through all other points."""
    x, y = np.array([0.0, 1.0, 2.0, 4.0, 7.0]), np.array([0.3, 0.9, 2.4, 3.7, 7.5])
    _, residuals = fit_line(x, y)
    for i in range(len(x)):
        others = np.arange(len(x)) != i
        expected = y[i] - np.polyval(np.polyfit(x[others], y[others], 1), x[i])
        assert residuals[i] == pytest.approx(expected)


def test_the_lines_hold_for_a_phantom_that_was_not_used(recordings, bundle, tables, table):
    certificate = calibrate(recordings, bundle, table, force_n=0.5)
    fresh = Inclusion(10.0, 5.5, 70.0)
    image = image_features(phantom_recording(fresh, tables, seed=77, scenario=LINEAR), certificate.settings)
    found = certificate.deformation_features(image).mean(axis=0)
    np.testing.assert_allclose(found, table_features(table, fresh, 0.5), rtol=0.05)
    assert certificate.regressions[0].r_squared > 0.995
    assert certificate.simulated


def test_the_table_gives_the_features_of_the_finite_elements(table):
    truth = Inclusion(8.0, 6.0, 90.0)
    lump = solve(Scene(truth, Press(force_n=0.5))).lump
    expected = lump.max_deformation_mm, lump.central_deformation_mm3, lump.deformation_area_mm2
    np.testing.assert_allclose(table_features(table, truth, 0.5), expected, rtol=0.02)  # its mesh is finite strain's


def test_the_areas_error_is_scaled_by_the_peak():
    np.testing.assert_allclose(scaled_errors(np.ones((2, 3)), np.array([0.1, 0.2])), [[1, 1, 0.1], [1, 1, 0.2]])


def test_too_few_phantoms_or_missing_truth_are_refused(recordings, bundle, table):
    with pytest.raises(InvalidQuantity, match="phantom recordings is 3"):
        calibrate(recordings[:3], bundle, table, force_n=0.5)
    nameless = [*recordings[:4], type(recordings[4])(**{**vars(recordings[4]), "truth": None})]
    with pytest.raises(InvalidQuantity, match="truth"):
        calibrate(nameless, bundle, table, force_n=0.5)
    with pytest.raises(InvalidQuantity, match="mean force of"):
        calibrate(recordings, bundle, table, force_n=0.6)
    with pytest.raises(InvalidQuantity, match="all equal"):
        calibrate([recordings[0]] * 4, bundle, table, force_n=0.5)
    foreign = [*recordings[:4], type(recordings[4])(**{**vars(recordings[4]), "serial": "OTHER"})]
    with pytest.raises(InvalidQuantity, match="serial"):
        calibrate(foreign, bundle, table, force_n=0.5)
