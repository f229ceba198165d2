"""Notices to an address of the hospital: that a measurement or an exam was made or changed, never whose it is.

Modules in reading order: `notice`, `address`, `notifier`.

It reads records and knows neither instrument nor web. What is sent and how it is signed: docs/webhook.md.
"""
