"""Stands in for a daemon that does not run: a page on its port that says why, and offers the way back.

Modules in reading order: `address`, `situation`, `words`, `page`, `actions`, `server`, `handover`.

Standard library only, of ours `access` and `errors`: it runs from the last good release under the
system's Python, also where a release's own packages are broken. It measures nothing and touches no hardware.
"""
