"""A scene file reads as the scene that was written, and says which key of it is wrong."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.scenes.scene import Placement, Press, Scene, Tissue, TissueLayer, Waveguide
from host_tools.scenes.scene_file import read_scene, write_scene

LAYERED = Scene(
    Inclusion(9.0, 7.0, 90.0),
    Press(force_n=0.4),
    Waveguide(8.0, (1.0, 2.0), (50.0, 10.0), 0.45, "square", 0.25),
    Tissue(6.0, 25.0, 70.0, 0.48, (TissueLayer("skin", 1.5, 30.0), TissueLayer("fat", 4.0, 2.0, 0.45)), 20.0),
    Placement(3.0, 0.0, 1.2, 0.8, 0.4),
)


@pytest.mark.parametrize("scene", [Scene(), LAYERED])
def test_a_scene_file_round_trips(scene, tmp_path):
    write_scene(scene, tmp_path / "scene.toml")
    assert read_scene(tmp_path / "scene.toml") == scene


@settings(max_examples=30, deadline=None)
@given(
    size=st.floats(0.0, 10.0),
    depth=st.floats(1e-6, 10.0, exclude_min=True),
    modulus=st.floats(1e-9, 1e9),
    poisson=st.floats(0.0, 0.5, exclude_max=True),
)
def test_every_digit_survives(tmp_path_factory, size, depth, modulus, poisson):
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    scene = Scene(Inclusion(size, depth, modulus), tissue=Tissue(poisson_ratio=poisson))
    write_scene(scene, path)
    assert read_scene(path) == scene


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[inclusion]\nsize_cm = 1.0\ndepth_mm = 6.0\nyoungs_modulus_kpa = 80.0", "did you mean inclusion.size_mm"),
        ("[inclusion]\nsize_mm = 10.0\ndepth_mm = 6.0", "youngs_modulus_kpa"),
        ("[waveguide]\nface = 'oval'", "'round' or 'square'"),
        (
            "[[tissue.layers]]\nname = 'skin'\nthickness_mm = 'thin'\nyoungs_modulus_kpa = 20.0",
            "layers[0].thickness_mm",
        ),
        ("[press]\nindentation_mm = 1.0\nforce_n = 1.0", "exactly one"),
        ("[press\n", "valid TOML"),
    ],
)
def test_a_wrong_file_is_refused_by_its_key(text, words, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(InvalidQuantity) as refused:
        read_scene(path)
    assert words in str(refused.value)
