"""Commissioning: ramps on phantoms to the modes quick, standard and precise of a probe that somebody built.

Modules in reading order: `phantom_ramps`, `probe_prior`, `bench_files`, `prior_discrepancy`, `joint_fit`, `left_out`,
`believed_presses`, `own_range`, `commission`, `own_quick`, `report`, `page_pictures`, `page`, `own_certificate`,
`own_bundle`.

Nothing that simulates a probe may enter, but for the camera's noise of one frame in `own_quick`, and presses in and
around the ranges in `own_range`, which the toolkit trains before any probe is there: what is read here are
recordings, and the bundles of the design.
"""
