"""A calibration's press beside the one that a network's card says it was trained with."""

from __future__ import annotations

import pytest

from device.files.bundle_file import read_paper_model
from device.files.certificate_file import read_calibration
from device.files.shipped import CERTIFICATES, MODELS, SIMULATED_PROBE
from device.measurement.paper_mode.trained_press import DEFAULT_SCENE, other_press
from host_tools.scenes.scene import Press, Scene

SAME = DEFAULT_SCENE["waveguide"]


def quantities(card, force_n=0.5, **changes):
    return [problem.quantity for problem in other_press(card, force_n, SAME | changes)]


def test_a_card_that_says_nothing_is_of_the_scene_that_the_toolkit_takes_by_default():
    surroundings = Scene(None, Press(force_n=0.5)).surroundings()
    assert surroundings["waveguide"] == SAME
    assert surroundings["press"]["force_n"] == DEFAULT_SCENE["press"]["force_n"]
    for card in ({}, {"scene_defaults": None}, {"scene_defaults": {"press": {}}}):
        assert quantities(card) == []
        assert quantities(card, force_n=0.3) == ["calibration's force_n"]


def test_a_card_of_scenes_that_were_pressed_to_a_depth_is_of_no_force():
    card = {"scene_defaults": {"press": {"indentation_mm": 1.0, "force_n": None}}}
    assert quantities(card) == ["calibration's force_n"]


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"force_n": 0.52}, []),
        ({"force_n": 0.54}, ["force_n"]),
        ({"force_n": float("nan")}, ["force_n"]),
        ({"radius_mm": 11.2}, []),
        ({"radius_mm": 12.0}, ["radius_mm"]),
        ({"layer_thicknesses_mm": (2.0, 3.5, 5.0)}, ["layer_thicknesses_mm"]),
        ({"layer_moduli_kpa": (60.0, 40.0)}, ["layer_moduli_kpa"]),
        ({"layer_moduli_kpa": 60.0}, ["layer_moduli_kpa"]),
        ({"poisson_ratio": 0.45, "face": "square", "dome_mm": 0.5}, ["poisson_ratio", "face", "dome_mm"]),
    ],
)
def test_what_differs_by_more_than_its_tolerance_is_named(changes, named):
    assert quantities({}, **changes) == [f"calibration's {name}" for name in named]


def test_the_sentence_says_both_numbers_with_their_unit_and_what_to_do():
    card = {"scene_defaults": {"waveguide": {"layer_thicknesses_mm": [2.0, 4.0, 5.0], "face": "square"}}}
    thicknesses, face = map(str, other_press(card, 0.5, SAME))
    assert "is 2, 3, 5 mm, but must be 2, 4, 5 mm within 3%, with which the model was trained" in thicknesses
    assert "is round, but must be square, with which" in face
    assert "host_tools sweep --probe" in thicknesses


def test_the_released_model_and_its_certificates_are_of_one_press():
    bundle = read_paper_model(MODELS / "paper")
    for name in CERTIFICATES.values():
        calibration = read_calibration(SIMULATED_PROBE / name)
        assert list(calibration.foreign(calibration.serial, bundle)) == []
        assert list(calibration.paper_lines.other_press(bundle)) == []
