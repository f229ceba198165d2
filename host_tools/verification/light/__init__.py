"""Does the light do what light does? Tracer and lookup model against optics on paper, Mitsuba, and each other.

Modules in reading order: `scenes`, `angles`, `on_paper`, `trapping`, `statistics`, `dimple`, `contact`, `press`,
`construction`, `lookup`, `cross_check`, `pictures`, `chapters`, `verdict`.

No table is made here.
"""
