"""Every number that a network reads has a unit and a sentence."""

import pytest

from device.measurement.feature_definitions import (
    IMAGE_FEATURES,
    INCLUSION_FIELD_FEATURES,
    QUICK_FEATURES,
    RADIAL_PROFILE_FEATURES,
    definition_of,
    unit_of_feature,
)
from device.measurement.paper_mode.features import FEATURE_NAMES
from device.measurement.quick_mode.profile import QUICK_NAMES
from device.measurement.ramp_modes.radial_profile import NETWORK_NAMES


@pytest.mark.parametrize(("names", "group"), [(NETWORK_NAMES, RADIAL_PROFILE_FEATURES), (QUICK_NAMES, QUICK_FEATURES)])
def test_every_name_of_a_row_is_defined_and_every_definition_is_of_a_name(names, group):
    assert {stem for stem in group for name in names if definition_of(name, group) is group[stem]} == set(group)


@pytest.mark.parametrize("group", [INCLUSION_FIELD_FEATURES, IMAGE_FEATURES, RADIAL_PROFILE_FEATURES, QUICK_FEATURES])
def test_every_number_has_a_unit_and_a_sentence(group):
    for name, definition in group.items():
        assert definition.sentence.endswith("."), name
        assert definition.unit in {"1", "N", "mm", "mm2", "mm3"}, name


def test_a_name_without_a_definition_is_refused():
    assert definition_of("contrast_0.40_n_0.9_mm", RADIAL_PROFILE_FEATURES).unit == "1"
    with pytest.raises(KeyError, match="contrasts"):
        definition_of("contrasts_0.40_n", RADIAL_PROFILE_FEATURES)


def test_the_features_of_an_image_are_defined():
    assert tuple(IMAGE_FEATURES) == FEATURE_NAMES


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("contrast_0.0_mm", "1"),
        ("trained_low_contrast_9.0_mm", "1"),
        ("contrast_0.40_n_0.9_mm", "1"),
        ("total_intensity", "mm2"),
        ("critical_centroid_intensity", "1"),
        ("bright_area_mm2", "mm2"),
        ("trained_high_central_deformation_mm3", "mm3"),
        ("force_n", "N"),
        ("tissue_modulus_std_kpa", "kPa"),
        ("critical_misfit_ratio", "1"),
    ],
)
def test_a_feature_has_its_defined_unit_and_any_other_that_of_its_name(name, unit):
    assert unit_of_feature(name) == unit
