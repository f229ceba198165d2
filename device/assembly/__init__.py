"""Puts the daemon together: the only room that knows drivers, simulation and instrument.

Modules in reading order: `probe`, `light`, `camera`, `cell`, `answers`, `opened_parts`.

No measuring but the first tare; no hardware library either, only drivers.
"""
