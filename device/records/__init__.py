"""What must never be lost: measurements and presses in SQLite, recordings and certificates on disk.

Modules in reading order: `schema`, `store`, `calibrations`, `disk`.

No hardware, no web: it acknowledges only what is on the disk.
"""
