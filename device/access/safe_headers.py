"""What every answer tells a browser: frame nothing of it, guess no types, load nothing from elsewhere."""

from __future__ import annotations

POLICY = "default-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"

SAFE_HEADERS = {
    "content-security-policy": POLICY,
    "x-frame-options": "DENY",
    "x-content-type-options": "nosniff",
    "referrer-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
}
"""Set on every answer. `no-referrer` would make a form of our own page send `Origin: null`."""
