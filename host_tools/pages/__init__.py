"""Measured numbers beside known ones, and the pages of docs/ made of them.

Modules in reading order: `benchmark`, `document`.

No measuring.
"""
