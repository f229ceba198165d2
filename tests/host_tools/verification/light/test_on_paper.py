"""The light of an LED on the face is that of a hand calculation, and the tracer finds it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from host_tools.verification.light.on_paper import BLOCK, benchmarks, irradiance, irradiance_by_point


def test_a_small_embedded_led_lights_the_centre_as_by_hand() -> None:
    """Straight: 12, 5, 13 mm; by the bottom: 12, 15, 19.2 mm, reflected at 38.66 degrees, where air takes 61.75."""
    small = replace(BLOCK, led_coupling="embedded", led_radius_mm=1e-3)
    straight = 12 / 13 * 5 / 13 / (math.pi * 13**2)
    far = math.hypot(12, 15)
    inside, outside = math.atan(12 / 15), math.asin(1.41 * 12 / far)
    perpendicular = math.sin(outside - inside) / math.sin(outside + inside)
    parallel = math.tan(outside - inside) / math.tan(outside + inside)
    mirrored = (perpendicular**2 + parallel**2) / 2 * 12 / far * 15 / far / (math.pi * far**2)
    assert irradiance(small, np.zeros(1), np.zeros(1))[0] == pytest.approx(straight + mirrored, rel=1e-6)


def test_behind_a_window_an_led_lights_nothing_beyond_the_critical_angle_from_its_axis() -> None:
    """5 mm above the LED the light ends 5 / tan(45.17 degrees) = 4.97 mm from its wall, at x = 7.03 mm."""
    behind = replace(BLOCK, led_coupling="air")
    x_mm = np.array([0.0, 6.9, 7.1, 11.0])
    light = irradiance_by_point(behind, (1.0, 0.0), 0.0, 5.0, x_mm, np.zeros(4), mirrored=False)
    assert (light > 0).tolist() == [True, True, False, False]


def test_the_tracer_finds_the_light_on_paper() -> None:
    assert max(benchmark.error for benchmark in benchmarks(100_000)) < 0.08
