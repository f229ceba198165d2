"""What who looks after the probe reads: its figures for a monitoring system, and the API's description as a page.

Modules in reading order: `metrics`, `manual`.

Nothing here is for the operator, and nothing tells who a patient is.
"""
