"""Light that the models do not know differs from theirs by as much as an independent tracer's did."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.ramp_modes.radial_profile import CONTRAST, RESPONSE
from host_tools.optics.other_light import other_optics
from host_tools.press_models.press_samples import draw_parameters, profile_rows


@pytest.mark.long
def test_rows_differ_by_some_tenths_of_a_percent_in_contrast_and_by_percents_in_the_response(tables):
    parameters = draw_parameters(8, np.random.default_rng(3))
    own, other = (
        profile_rows(one, parameters) for one in (tables, replace(tables, light=other_optics(rays=2_000_000)))
    )
    contrast, response = (np.sqrt(np.mean((other - own)[:, part] ** 2)) for part in (CONTRAST, RESPONSE))
    assert 0.001 < contrast < 0.005
    assert 0.005 < response < 0.03
