"""A scene that cannot exist is refused by the name of the quantity, with its value and its bound."""

import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.scenes.scene import Placement, Press, Scene, Tissue, TissueLayer, Waveguide

SKIN = Tissue(layers=(TissueLayer("skin", 2.0, 20.0),))


@pytest.mark.parametrize(
    ("build", "quantity", "words"),
    [
        (lambda: Inclusion(-1.0, 6.0, 80.0), "size_mm", "-1.0"),
        (lambda: Inclusion(10.0, 0.0, 80.0), "depth_mm", "above 0"),
        (lambda: Inclusion(10.0, 6.0, float("nan")), "youngs_modulus_kpa", "nan"),
        (lambda: Inclusion("10 mm", 6.0, 80.0), "size_mm", "a number"),
        (lambda: Scene(Inclusion(15.0, 15.0, 80.0)), "depth_mm + size_mm", "30 mm"),
        (lambda: Press(), "press", "exactly one"),
        (lambda: Press(indentation_mm=1.0, force_n=0.5), "press", "exactly one"),
        (lambda: Press(force_n=-0.5), "force_n", "above 0"),
        (lambda: Scene(None, Press(indentation_mm=30.0)), "indentation_mm", "30 mm"),
        (lambda: Waveguide(layer_moduli_kpa=(60.0, 40.0)), "layer_moduli_kpa", "3 layer"),
        (lambda: Waveguide(layer_thicknesses_mm=(2.0, 0.0, 5.0)), "layer_thicknesses_mm[1]", "above 0"),
        (lambda: Waveguide(poisson_ratio=0.5), "waveguide.poisson_ratio", "below 0.5"),
        (lambda: Tissue(youngs_modulus_kpa=0.0), "tissue_modulus_kpa", "above 0"),
        (lambda: Scene(None, waveguide=Waveguide(radius_mm=60.0)), "radius_mm", "60 mm"),
        (lambda: Scene(None, waveguide=Waveguide(45.0, face="square")), "radius_mm", "63.6396 mm"),
        (lambda: Waveguide(face="oval"), "waveguide.face", "'round'"),
        (lambda: Waveguide(dome_mm=1.5), "waveguide.dome_mm", "half the first layer"),
        (lambda: Scene(Inclusion(10.0, 2.0, 80.0), tissue=SKIN), "depth_mm", "skin's thickness of 2 mm"),
        (lambda: Tissue(layers=(TissueLayer("fat", 30.0, 3.0),)), "sum of tissue.layers thickness_mm", "30 mm"),
        (lambda: TissueLayer("fat", 3.0, -1.0), "fat.youngs_modulus_kpa", "-1.0"),
        (lambda: Scene(Inclusion(10.0, 6.0, 80.0), placement=Placement(55.0)), "size_mm / 2 + offset", "60 mm"),
        (lambda: Scene(None, tissue=Tissue(edge_mm=10.0)), "radius_mm", "10 mm"),
        (
            lambda: Scene(Inclusion(10.0, 6.0, 80.0), tissue=Tissue(edge_mm=15.0), placement=Placement(12.0)),
            "size_mm / 2 + offset_x_mm",
            "15 mm",
        ),
        (lambda: Placement(width_ratio_x=0.0), "placement.width_ratio_x", "0.2"),
        (lambda: Placement(poisson_ratio=0.5), "placement.poisson_ratio", "below 0.5"),
    ],
)
def test_an_impossible_scene_is_refused_by_name(build, quantity, words):
    with pytest.raises(InvalidQuantity) as refused:
        build()
    assert refused.value.quantity == quantity
    assert words in str(refused.value)


@pytest.mark.parametrize("inclusion", [None, Inclusion(0.0, 6.0, 80.0), Inclusion(10.0, 6.0, 5.0)])
def test_nothing_to_solve_for_is_no_inclusion(inclusion):
    assert not Scene(inclusion).has_inclusion


def test_an_inclusion_of_another_poisson_ratio_is_one():
    assert Scene(Inclusion(10.0, 6.0, 5.0), placement=Placement(poisson_ratio=0.3)).has_inclusion


def test_an_inclusion_knows_the_layers_it_lies_in():
    layers = (TissueLayer("skin", 1.5, 20.0), TissueLayer("fat", 7.0, 3.0))
    scene = Scene(Inclusion(10.0, 6.0, 80.0), tissue=Tissue(layers=layers))
    assert [layer.name for layer in scene.layers_around_inclusion] == ["fat", "tissue"]
    assert Scene(Inclusion(10.0, 6.0, 3.0), tissue=Tissue(layers=layers)).has_inclusion  # the bulk around it differs
