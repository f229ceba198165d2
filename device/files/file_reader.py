"""Whether a user can read a file: the daemon's, asked by whoever checks a machine for it, most often root."""

from __future__ import annotations

import os
import pwd
import subprocess
from dataclasses import dataclass
from pathlib import Path

DAEMON_USER = "tsis"
TEST_S = 10.0


@dataclass(frozen=True)
class FileReader:
    """A user who is to read files; `account` unless that is this process, `note` when it is not the daemon's user."""

    name: str
    account: pwd.struct_passwd | None = None
    note: str = ""

    def can_read(self, path: Path) -> bool:
        """Return whether this user may read a file, by the kernel's own judgement: bits, owner, lists and folders."""
        if self.account is None:
            return os.access(path, os.R_OK)
        user, group = self.account.pw_uid, self.account.pw_gid
        groups = os.getgrouplist(self.name, group)
        asked = ["test", "-r", str(path.absolute())]
        done = subprocess.run(asked, user=user, group=group, extra_groups=groups, timeout=TEST_S, cwd="/", check=False)
        return done.returncode == 0


def daemon_reader() -> FileReader:
    """Return the daemon's user where this process may stand for it, else this process' own, and say so."""
    own = user_name(os.geteuid())
    try:
        account = pwd.getpwnam(DAEMON_USER)
    except KeyError:
        as_root = ", who may read everything" if os.geteuid() == 0 else ""
        return FileReader(own, note=f"This machine has no user {DAEMON_USER}: read as {own}{as_root}.")
    if account.pw_uid == os.geteuid():
        return FileReader(DAEMON_USER)
    if os.geteuid() == 0:
        return FileReader(DAEMON_USER, account)
    return FileReader(
        own, note=f"Read as {own}; the daemon runs as {DAEMON_USER}: run this with sudo to ask for that user."
    )


def user_name(number: int) -> str:
    """Return the name of a user of this machine, or the number of one that has none."""
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return str(number)
