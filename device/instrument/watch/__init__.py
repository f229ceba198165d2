"""Whether all goes on: each part's progress, systemd's watchdog, the wall clock, the computer, and the certificate.

Modules in reading order: `progress`, `readiness`, `watchdog`, `restart_note`, `clock_watch`, `computer_watch`,
`calibration_watch`.

No repair and no measurement: it judges and tells.
"""
