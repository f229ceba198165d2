"""Phantom recordings to a calibration certificate.

Modules in reading order: `phantom`, `phantom_sets`, `gates`, `known_bench`, `calibrate`.

Nothing is judged by eye: a certificate passes its gates or is not written.
"""
