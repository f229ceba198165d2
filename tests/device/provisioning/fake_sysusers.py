"""Stands for systemd-sysusers: writes the users and groups of its standard input into the tables below a folder."""

import sys
from pathlib import Path

etc = Path(sys.argv[1], "etc")
lines = [line.split() for line in sys.stdin if line.strip() and not line.startswith("#")]
groups = dict(line.rsplit(":", 1) for line in (etc / "group").read_text().splitlines())
members = {name.split(":")[0]: said.split(",") if said else [] for name, said in groups.items()}
for kind, name, *rest in lines:
    if kind in "ugm":
        members.setdefault(rest[0] if kind == "m" else name, [])
    if kind == "m" and name not in members[rest[0]]:
        members[rest[0]].append(name)
numbers = {name.split(":")[0]: name for name in groups}
with (etc / "passwd").open("a") as users:
    users.writelines(f"{name}:x:999:999::/:/bin/sh\n" for kind, name, *_ in lines if kind == "u")
told = [f"{numbers.get(name, f'{name}:x:999')}:{','.join(of)}\n" for name, of in members.items()]
(etc / "group").write_text("".join(told))
