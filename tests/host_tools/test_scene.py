"""A scene that cannot exist is refused by the name of the quantity, with its value and its bound."""

import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.scene import Press, Scene, Tissue, Waveguide


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
        (lambda: Waveguide(poisson_ratio=0.5), "waveguide.poisson_ratio", "0.499"),
        (lambda: Tissue(youngs_modulus_kpa=0.0), "tissue_modulus_kpa", "above 0"),
        (lambda: Scene(None, waveguide=Waveguide(radius_mm=60.0)), "radius_mm", "60 mm"),
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
