"""Finite elements to the tables that the virtual probe runs on.

Modules in reading order: `force_ramps`, `slab_changes`, `surface_table`, `changes_in_slabs`, `layer_table`,
`face_motion`, `tissue_layers`, `cosine_modes`, `aside_changes`, `off_axis_table`, `out_of_range_table`, `ellipsoid`.

How a table is read stands in `device.simulation.physics`.
"""
