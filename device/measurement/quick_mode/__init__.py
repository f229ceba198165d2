"""Mode quick: one held frame, one row of contrast, one call of the networks.

Modules in reading order: `profile`, `model`.

What it shares with the ramp modes it takes from them.
"""
