"""The probe tests its own parts: each check measures one thing, says within which bound it must be, and names the part.

Modules in reading order: `report`, `checks`, `run`, `requests`.

Checks get numbers and frames; only `run` touches the bench, between presses.
"""
