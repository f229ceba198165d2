"""Whether all goes on: progress, watchdog, wall clock, computer, recordings, space, backups, and the certificate.

Modules in reading order: `progress`, `readiness`, `watchdog`, `restart_note`, `clock_watch`, `computer_watch`,
`recordings_watch`, `space_watch`, `backup_watch`, `calibration_watch`, `zero_watch`.

No repair and no measurement: it judges and tells.
"""
