"""What must never be lost: exams, measurements and presses in SQLite, recordings and certificates on disk, releases.

Modules in reading order: `schema`, `asked_once`, `audit`, `exams`, `listing`, `tokens`, `outbox`, `manifest`,
`migrations`, `database`, `recordings`, `saved`, `retention`, `store`, `calibrations`, `disk`, `updates`,
`release_head`.

No hardware, no web: it acknowledges only what is on the disk.
"""
