"""What a calibration must measure: each gate says its quantity, value, bound and what to do."""

import pickle

import numpy as np
import pytest

from device.measurement.paper_mode.lines import Regression
from device.measurement.quantities import Bound, InvalidQuantity
from device.measurement.recording.untouched_face import UntouchedFace
from host_tools.calibration.gates import CalibrationRejected, Gate, fit_gates, recording_gates, require_all
from host_tools.calibration.phantom import phantom_recording

SPREAD = np.outer([-1.0, 0.0, 1.0], [1.0, 10.0, 100.0])
"""Standard deviations 1, 10 and 100."""


def failed(gates):
    return [gate.quantity for gate in gates if gate.problem]


def lines(r_squared=(0.95, 0.95, 0.85), left_out=(0.3, 3.0, 50.0)):
    return [Regression(1.0, 0.0, r2, std) for r2, std in zip(r_squared, left_out, strict=True)]


def test_a_fit_at_its_bounds_passes():
    gates = fit_gates(lines(), SPREAD)
    assert failed(gates) == []
    assert [gate.value for gate in gates] == pytest.approx([0.95, 0.3, 0.95, 0.3, 0.85, 0.5])


@pytest.mark.parametrize(
    ("worse", "quantities"),
    [
        ({"r_squared": (0.949, 0.99, 0.9)}, ["R2 of max_deformation_mm"]),
        ({"r_squared": (0.99, 0.99, 0.849)}, ["R2 of deformation_area_mm2"]),
        ({"left_out": (0.1, 3.1, 10.0)}, ["leave-one-out error of central_deformation_mm3"]),
        (
            {"r_squared": (0.99, 0.5, 0.9), "left_out": (0.1, 6.0, 51.0)},
            [
                "R2 of central_deformation_mm3",
                "leave-one-out error of central_deformation_mm3",
                "leave-one-out error of deformation_area_mm2",
            ],
        ),
    ],
)
def test_each_feature_has_its_own_bounds(worse, quantities):
    assert failed(fit_gates(lines(**worse), SPREAD)) == quantities


def test_a_rejection_tells_every_gate_with_value_bound_and_action():
    gates = [
        Gate("dark level", 13.0, Bound(0.0, 12.0, "counts"), "shade the probe"),
        Gate("R2 of O1", 0.5, Bound(0.95, 1.0, ""), "press again"),
        Gate("R2 of O2", 0.99, Bound(0.95, 1.0, ""), "press again"),
    ]
    with pytest.raises(CalibrationRejected) as rejection:
        require_all(gates, [InvalidQuantity("truth", "missing", "there", "add it")])
    assert str(rejection.value).splitlines() == [
        "truth is missing, but must be there: add it.",
        "dark level is 13, but must be at least 0 and at most 12 counts: shade the probe.",
        "R2 of O1 is 0.5, but must be at least 0.95 and at most 1: press again.",
    ]
    carried = pickle.loads(pickle.dumps(rejection.value))
    assert (str(carried), len(carried.problems)) == (str(rejection.value), 3)


def test_what_passes_is_not_rejected():
    assert require_all([Gate("dark level", 4.0, Bound(0.0, 12.0, "counts"), "shade the probe")]) is None


def test_phantoms_that_are_alike_a_bright_dark_and_saturation_are_each_named(recording, tables):
    """Two phantoms of one depth, a dark level of 25 counts, and a frame that is full in its first two rows of 492."""
    deep = phantom_recording(type(recording.truth)(3.0, 6.0, 110.0), tables, seed=2)
    deep.frames[-1].counts[:2] = 255
    face = UntouchedFace(25.0, (0.0,) * 4, 0.0, 60.0, 0.6)
    assert failed(recording_gates([recording, deep], face)) == [
        "phantoms",
        "spread of the phantoms' depth_mm",
        "dark level",
        "saturated pixels",
    ]
