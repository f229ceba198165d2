"""The virtual probe: one scene drives light, image and force.

Modules in reading order: `scenario`, `virtual_probe`, `hand`, `grid_target`, `faults`.

Rooms: `physics` (tissue, light, sensor), `chips` (the bytes and frames that drivers see). NumPy only; it knows no
driver.
"""
