"""Stands for systemd-sysusers: writes the users and groups of its standard input into the tables below a folder."""

import sys
from pathlib import Path

etc = Path(sys.argv[1], "etc")
lines = [line.split() for line in sys.stdin if line.strip() and not line.startswith("#")]
members: dict[str, list[str]] = {}
for kind, name, *rest in lines:
    if kind == "m":
        members.setdefault(rest[0], []).append(name)
with (etc / "passwd").open("a") as users, (etc / "group").open("a") as groups:
    for kind, name, *_ in lines:
        if kind == "u":
            users.write(f"{name}:x:999:999::/:/bin/sh\n")
        if kind in "ug":
            groups.write(f"{name}:x:999:{','.join(members.get(name, []))}\n")
