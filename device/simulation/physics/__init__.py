"""Tissue, light and sensor of the virtual probe, from tables and closed formulas.

Modules in reading order: `slab`, `inclusion_axes`, `chebyshev`, `slab_changes`, `surface_table`, `layer_table`,
`face_motion`, `off_axis_table`, `neighbour`, `pressed_face`, `light_table`, `skin`, `lookup_optics`, `world`,
`world_face`, `image_formation`, `lens`, `sensor`.

No clock, no bus and no bytes of a line; finite elements and ray tracing stand in `host_tools`.
"""
