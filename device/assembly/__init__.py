"""Puts the daemon together: the only room that knows drivers, simulation and instrument, and real parts from emulated
ones.

Modules in reading order: `probe`, `camera`, `cell`, `answers`, `opened_parts`.

No measuring but the first tare; no hardware library either, only drivers.
"""
