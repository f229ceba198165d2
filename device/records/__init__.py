"""What must never be lost: measurements and presses in SQLite, recordings and certificates on disk, releases.

Modules in reading order: `schema`, `store`, `calibrations`, `disk`, `updates`, `release_head`.

No hardware, no web: it acknowledges only what is on the disk.
"""
