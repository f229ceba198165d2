"""Phantom recordings to a calibration certificate, and those of a grid target to the camera's geometry.

Modules in reading order: `phantom`, `phantom_sets`, `bench_folder`, `gates`, `known_bench`, `certified_probe`,
`calibrate`, `grid_dots`, `camera_fit`.

Nothing is judged by eye: a certificate passes its gates or is not written.
"""
