"""How well size, depth and modulus can be known at all: Cramer-Rao bounds of a protocol, a press, and over the box.

Modules in reading order: `protocol`, `rings`, `observed_press`, `observation`, `information`, `bounds`, `press_bound`,
`accuracy_map`, `accuracy_tables`, `accuracy_page`, `accuracy_figure`.

No estimator: a bound holds for all of them.
"""
