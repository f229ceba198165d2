"""Mode quick: one held frame, one row of contrast, one call of a network.

Modules in reading order: `profile`, `roundness`, `model`.

What it shares with the ramp modes it takes from them.
"""
