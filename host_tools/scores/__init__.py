"""What the modes are worth: recordings with truth to errors, coverage and refusals, beside the best that could be had.

Modules in reading order: `score_recordings`, `paper_scores`, `dial`, `coverage`, `posterior`,
`rank_histograms`, `scan`, `noise_free`, `span`, `outside`, `just_outside`, `ellipsoids`, `breast_imager`,
`foreign_probes`, `camera_trial`, `foreign_presses`, `scored_presses`, `robustness`. In `one_thing`, what each thing
alone costs.

No training; what is scored has been frozen before, and `dial` adds its figures to the card.
"""
