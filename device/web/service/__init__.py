"""What who looks after the probe reads: figures for a monitoring system, the API as a page, how far notices got,
and whom to tell of a vulnerability.

Modules in reading order: `metrics`, `manual`, `webhook`, `security_contact`.

Nothing here is for the operator, and nothing tells who a patient is.
"""
