"""Settings of a scene over those of a probe."""

from pathlib import Path

import pytest

from device.config import CameraSection, Config, LightSection
from device.measurement.quantities import InvalidQuantity
from device.settings.override import overridden

OWN = Config(serial="TSIS-0007", camera=CameraSection(frame_rate_hz=100.0), light=LightSection(max_on_s=60.0))


def test_what_is_stated_replaces_its_own_setting_and_nothing_else():
    table = {"calibration": "somewhere", "light": {"ratio": [0.1, 0.2, 0.3, 0.4]}}
    config = overridden(OWN, table)
    assert config.calibration == Path("somewhere")
    assert config.light == LightSection(max_on_s=60.0, ratio=(0.1, 0.2, 0.3, 0.4))
    assert (config.serial, config.camera) == ("TSIS-0007", OWN.camera)
    assert overridden(OWN, {}) == OWN


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"light": {"max_on": 1.0}}, "light.max_on is 1.0.*did you mean light.max_on_s"),
        ({"light": 1.0}, "light is 1.0, but must be a table"),
        ({"light": {"max_on_s": "long"}}, "light.max_on_s is 'long', but must be of type float"),
        ({"light": {"max_on_s": 0.0}}, "light.max_on_s is 0.0, but must be at least 1 "),
        ({"camera": {"exposure_us": 20_000}}, "camera.exposure_us is 20000.*10000"),
    ],
)
def test_a_setting_that_is_unknown_mistyped_out_of_range_or_does_not_fit_is_refused_by_its_name(table, words):
    with pytest.raises(InvalidQuantity, match=words):
        overridden(OWN, table)
