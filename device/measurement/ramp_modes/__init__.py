"""Modes standard and precise: one force ramp on the lesion or several, to the posterior of the unknowns.

Modules in reading order: `radial_profile`, `legendre`, `surrogate`, `noise`, `bounded_least_squares`, `fit`,
`posterior`, `intervals`, `scan`, `model`, `ellipticity`, `range_classifier`, `estimate`.

Nothing of mode paper or mode quick; training stands in `host_tools.press_models`.
"""
