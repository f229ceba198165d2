"""Tissue, light and sensor of the virtual probe, from tables and closed formulas.

Modules in reading order: `slab`, `inclusion_axes`, `chebyshev`, `table_file`, `surface_table`, `off_axis_table`,
`neighbour`, `pressed_face`, `light_table`, `skin`, `lookup_optics`, `image_formation`, `lens`, `sensor`.

No clock, no bus and no bytes of a line; finite elements and ray tracing stand in `host_tools`.
"""
