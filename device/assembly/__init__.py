"""Puts the daemon together: the only room that knows all others, and the only one that knows real parts from emulated
ones.

Modules in reading order: `probe`, `camera`, `cell`, `answers`, `opened_parts`.

No measuring, no waiting, no arithmetic; no hardware library either, only drivers.
"""
