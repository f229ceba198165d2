"""The sides of the waveguide, and how bright the LED of each is.

Needs no NumPy: whatever darkens the LEDs has to be quick (device/commands/led_off.py).
"""

from __future__ import annotations

SIDES = ("+x", "+y", "-x", "-y")
"""The sides of the waveguide in the order of every `LedRatio` and of the chip's outputs 0-3; each has one LED."""
LedRatio = tuple[float, float, float, float]
"""Brightness of the sides +x, +y, -x, -y as a ratio of full scale, 0..1."""
