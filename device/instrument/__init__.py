"""Leads a press, from a touch to a measurement that is kept: `procedure` is the loop, `status` is what it tells.
`focusing` holds the light on for whoever turns the lens.

Modules in reading order: `procedure`, `status`, `focusing`.

Rooms: `acquisition` (one frame under known light and force), `press` (which frames, which states), `watch` (does all
go on), `self_test`. No hardware library and no simulation: the bench is handed in.
"""
