"""Modes standard and precise: the contrast on rings at four forces, by an ensemble or by fitting the forward model.

Modules in reading order: `radial_profile`, `legendre`, `surrogate`, `noise`, `bounded_least_squares`, `fit`,
`posterior`, `model`, `ellipticity`, `range_classifier`, `estimate`.

Nothing of mode paper or mode quick; training stands in `host_tools.press_models`.
"""
