"""Measured numbers beside known ones, and the pages of docs/ made of them.

Modules in reading order: `benchmark`, `page`.

Prose stands in docs/templates, numbers in docs/results. No measuring.
"""
