"""Care for a probe over the years: a backup, the way back to a new card, its end, and what a maintainer needs to help.

Modules in reading order: `archive`, `places`, `snapshot`, `broken_off`, `backup`, `restore`, `erase`,
`known_words`, `support_sections`, `support`.

No press and no web: it reads and writes what lies on the disk, while the daemon runs or when it cannot. What makes the
support file imports the standard library alone until it needs more: it has to work where nothing else does.
"""
