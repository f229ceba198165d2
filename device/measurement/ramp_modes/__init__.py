"""Modes standard and precise: one force ramp on the lesion or several, to the posterior of the unknowns.

Modules in reading order: `radial_profile`, `legendre`, `surrogate`, `noise`, `bounded_least_squares`, `fit`,
`posterior`, `intervals`, `scan`, `answers`, `row_derivatives`, `own_probe`, `own_posterior`, `own_answers`,
`ellipticity`, `range_classifier`, `model`, `estimate`. Those that begin with own are of a commissioned probe.

Nothing of mode paper or mode quick; training stands in `host_tools.press_models`.
"""
