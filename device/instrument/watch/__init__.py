"""Whether all goes on: each part's progress, the watchdog, the wall clock, computer, recordings, and the certificate.

Modules in reading order: `progress`, `readiness`, `watchdog`, `restart_note`, `clock_watch`, `computer_watch`,
`recordings_watch`, `calibration_watch`.

No repair and no measurement: it judges and tells.
"""
