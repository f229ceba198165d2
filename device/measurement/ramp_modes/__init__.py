"""Modes standard and precise: one force ramp on the lesion or several, to the posterior of the unknowns.

Modules in reading order: `radial_profile`, `legendre`, `surrogate`, `noise`, `bounded_least_squares`,
`misfit_blocks`, `fit`, `within_ranges`, `joint_region`, `posterior`, `intervals`, `scan`, `answers`, `ellipticity`,
`range_classifier`, `model`, `estimate`.

Room: `commissioned` (a probe that somebody built), which `model` reads.

Nothing of mode paper or mode quick; training stands in `host_tools.press_models`.
"""
