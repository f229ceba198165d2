"""Verbs that only look: what the probe does, what it keeps, what a rule would delete; also beside a daemon.

Modules in reading order: `status`, `exams`, `export`, `retention`, `audit`.

Nothing here writes to the store.
"""
