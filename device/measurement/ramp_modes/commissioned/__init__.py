"""A probe that somebody built: what is believed of it and of its presses, and how they are answered.

Modules in reading order: `row_derivatives`, `discrepancy`, `squared_tilt`, `own_probe`, `own_posterior`,
`moving_posterior`, `own_answers`.

Nothing is fitted to phantoms here: that is `host_tools.commissioning`, whose bundle is read.
"""
