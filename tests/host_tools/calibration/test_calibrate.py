"""Regressions with known answers, and a certificate from simulated phantoms."""

import copy
import dataclasses

import numpy as np
import pytest

from device.measurement.calibration import Validity
from device.measurement.paper_mode.estimate import image_features
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.scenario import Scenario
from host_tools.calibration import calibrate as calibrate_module
from host_tools.calibration.calibrate import (
    Provenance,
    calibrate,
    fit_line,
    scaled_errors,
    source_sha256,
    table_features,
)
from host_tools.calibration.gates import CalibrationRejected, unusable
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.forward.solve import solve
from host_tools.scenes.scene import Press, Scene

LINEAR = Scenario(light="linear")
DESIGNS = [
    (14.0, 4.5, 110.0),
    (12.0, 7.0, 60.0),
    (9.0, 5.0, 80.0),
    (11.0, 9.0, 100.0),
    (6.0, 6.0, 50.0),
    (8.0, 4.5, 90.0),
]


@pytest.fixture(scope="module")
def recordings(tables):
    """In the paper's light, for which its lines are made."""
    return [
        phantom_recording(Inclusion(*d), tables, seed=i, protocol=PhantomProtocol(frames=3), scenario=LINEAR)
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


def test_all_recordings_of_a_phantom_are_left_out_of_its_line_together():
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0, 1, 9), rng.uniform(0, 1, 9)
    phantoms = [0, 0, 0, 1, 1, 2, 3, 4, 4]
    _, residuals = fit_line(x, y, phantoms)
    for place, phantom in enumerate(phantoms):
        others = np.array(phantoms) != phantom
        slope, intercept = np.polyfit(x[others], y[others], 1)
        assert residuals[place] == pytest.approx(y[place] - slope * x[place] - intercept, abs=1e-12)


def test_a_model_of_another_press_or_waveguide_is_refused_before_anything_is_measured(
    recordings, bundle, table, monkeypatch
):
    monkeypatch.setattr(calibrate_module, "untouched_face", lambda _: pytest.fail("measured"))
    other = copy.copy(bundle)
    scene = bundle.card["scene_defaults"]
    stiffer = scene["waveguide"] | {"layer_moduli_kpa": [90.0, 40.0, 20.0]}
    other.card = bundle.card | {"scene_defaults": scene | {"press": {"force_n": 0.3}, "waveguide": stiffer}}
    with pytest.raises(CalibrationRejected) as rejection:
        calibrate(recordings, other, table, force_n=0.5)
    force, moduli = rejection.value.problems
    assert (force.quantity, force.value, force.bound[:5]) == ("calibration's force_n", "0.5 N", "0.3 N")
    assert force.action == "calibrate with --force-n 0.3, or train on a sweep of 0.5 N"
    assert (moduli.quantity, moduli.value) == ("calibration's layer_moduli_kpa", "60, 40, 20 kPa")
    assert "90, 40, 20 kPa within 3%" in moduli.bound


def test_the_lines_hold_for_a_phantom_that_was_not_used(recordings, bundle, tables, table):
    certificate = calibrate(recordings, bundle, table, force_n=0.5).certificate
    fresh = Inclusion(10.0, 5.5, 70.0)
    image = image_features(phantom_recording(fresh, tables, seed=77, scenario=LINEAR), certificate.lines.settings)
    found = certificate.lines.deformation_features(image).mean(axis=0)
    np.testing.assert_allclose(found, table_features(table, fresh, 0.5), rtol=0.05)
    assert certificate.lines.regressions[0].r_squared > 0.995
    assert certificate.simulated


def test_the_table_gives_the_features_of_the_finite_elements(table):
    truth = Inclusion(8.0, 6.0, 90.0)
    inclusion = solve(Scene(truth, Press(force_n=0.5))).inclusion_field
    expected = inclusion.max_deformation_mm, inclusion.central_deformation_mm3, inclusion.deformation_area_mm2
    np.testing.assert_allclose(table_features(table, truth, 0.5), expected, rtol=0.02)  # its mesh is finite strain's


def test_the_areas_error_is_scaled_by_the_peak():
    np.testing.assert_allclose(scaled_errors(np.ones((2, 3)), np.array([0.1, 0.2])), [[1, 1, 0.1], [1, 1, 0.2]])


def changed(recording, **changes):
    return dataclasses.replace(recording, **changes)


def pressed_again(recording):
    """Another press on the same phantom: no pixel need differ but one."""
    frames = list(recording.frames)
    counts = frames[-1].counts.copy()
    counts[0, 0] ^= 1
    frames[-1] = dataclasses.replace(frames[-1], counts=counts)
    return changed(recording, frames=tuple(frames))


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda all_of: all_of[:3], "phantoms is 3, but must be at least 6"),
        (lambda all_of: [*all_of[:5], changed(all_of[5], truth=None)], "truth is missing in"),
        (lambda all_of: [*all_of[:5], changed(all_of[5], cell=None)], "cell is missing in"),
        (lambda all_of: [*all_of[:5], changed(all_of[5], serial="OTHER")], "serial is OTHER and SIM-LINEAR"),
        (
            lambda all_of: [*all_of[:5], changed(all_of[5], camera=dataclasses.replace(all_of[5].camera, gain=2.0))],
            "camera is .* the same in all recordings",
        ),
        (
            lambda all_of: [*all_of[:5], changed(all_of[5], phantom_serial="PH-4")],
            "phantom_serial is PH-4 and none, but must be the same in all recordings",
        ),
        (
            lambda all_of: [
                *all_of[:5],
                changed(all_of[5], cell=dataclasses.replace(all_of[5].cell, counts_per_n=100_400.0)),
            ],
            "counts_per_n is .* the same in all recordings",
        ),
        (lambda all_of: [*all_of[:5], pressed_again(all_of[0])], "phantoms is 5, but must be at least 6"),
        (lambda all_of: [*all_of[:6], changed(all_of[2], id="x", started_at="2027-01-01T00:00:00Z")], "again"),
    ],
)
def test_recordings_that_are_no_calibration_are_refused(recordings, bundle, table, spoil, words):
    with pytest.raises(InvalidQuantity, match=words):
        calibrate(spoil(recordings), bundle, table, force_n=0.5)


def test_recordings_that_name_no_set_are_of_the_one_that_is_stated(recordings):
    named = [changed(recordings[0], phantom_serial="PH-4"), *recordings[1:3]]
    assert [one.quantity for one in unusable(named, 0.5)] == ["phantom_serial"]
    assert unusable(named, 0.5, "PH-4") == []
    assert [one.value for one in unusable(named, 0.5, "PH-3")] == ["PH-3 and PH-4"]


def test_a_tare_that_was_noted_between_recordings_is_no_disagreement(recordings):
    noted = changed(recordings[0], cell=dataclasses.replace(recordings[0].cell, tare_counts=8150.0))
    assert unusable([noted, *recordings[1:3]], 0.5) == []


def test_all_that_is_wrong_with_the_recordings_is_told_at_once(recordings, bundle, table):
    bad = [changed(recordings[0], truth=None), changed(recordings[1], serial="OTHER"), recordings[2]]
    with pytest.raises(CalibrationRejected) as rejection:
        calibrate(bad, bundle, table, force_n=0.6)
    found = [problem.quantity.split(" of ")[0] for problem in rejection.value.problems]
    assert found == ["truth", "mean force", "mean force", "mean force", "serial", "calibration's force_n", "phantoms"]


MADE_AT = "2027-05-01T12:00:00Z"


@pytest.fixture
def real(recordings):
    """As if a real probe had recorded them, a day after the other."""
    return [
        changed(recording, started_at=f"2027-03-0{i + 1}T12:00:00Z", simulated=False)
        for i, recording in enumerate(recordings)
    ]


def test_the_certificate_says_from_where_it_comes_and_how_long_it_holds(real, bundle, table):
    stated = Provenance("N. N.", "PH-3", MADE_AT, valid_days=100.0)
    certificate, gates = calibrate(real, bundle, table, force_n=0.5, provenance=stated)
    assert (certificate.operator, certificate.phantom_serial, certificate.made_at) == ("N. N.", "PH-3", MADE_AT)
    assert certificate.validity == Validity("2027-03-01T12:00:00Z", "2027-06-09T12:00:00Z")
    assert (certificate.camera, certificate.cell) == (real[0].camera, real[0].cell)
    assert certificate.software_sha256 == source_sha256()
    assert all(gate.problem is None for gate in gates)


@pytest.mark.long
def test_the_set_of_phantoms_is_that_of_the_recordings_unless_it_is_stated(real, bundle, table):
    recorded = [changed(recording, phantom_serial="PH-4") for recording in real]
    for stated, expected in (("", "PH-4"), ("PH-3", "PH-3")):
        provenance = Provenance(phantom_serial=stated, made_at=MADE_AT)
        certificate = calibrate(recorded, bundle, table, force_n=0.5, provenance=provenance).certificate
        assert certificate.phantom_serial == expected


@pytest.mark.long
def test_a_real_probe_is_calibrated_for_a_year_and_a_simulated_one_for_a_hundred(recordings, real, bundle, table):
    found = [
        calibrate(all_of, bundle, table, force_n=0.5, provenance=Provenance(made_at=MADE_AT)).certificate.validity
        for all_of in (real, recordings)
    ]
    assert [one.expires_at for one in found] == ["2028-02-29T12:00:00Z", "2069-12-07T00:00:00Z"]


@pytest.mark.parametrize("made_at", ["2028-02-29T12:00:00Z", "2027-02-28T11:59:59Z"])
def test_recordings_that_are_too_old_or_still_to_come_give_no_certificate(real, bundle, table, made_at):
    with pytest.raises(CalibrationRejected) as rejection:
        calibrate(real, bundle, table, force_n=0.5, provenance=Provenance(made_at=made_at))
    assert [problem.quantity for problem in rejection.value.problems] == ["age of the oldest recording"]


def test_exchanged_truths_are_rejected_by_name_of_the_feature(recordings, bundle, table):
    truths = [recording.truth for recording in recordings]
    mixed = [changed(one, truth=truth) for one, truth in zip(recordings, truths[1:] + truths[:1], strict=True)]
    with pytest.raises(CalibrationRejected) as rejection:
        calibrate(mixed, bundle, table, force_n=0.5)
    found = {problem.quantity for problem in rejection.value.problems}
    assert {"R2 of max_deformation_mm", "leave-one-out error of max_deformation_mm"} <= found
