"""`host_tools release` as typed: keys, lists of signers, and what is asked for in vain."""

from __future__ import annotations

import pytest
from toolkit_process import run_toolkit


@pytest.fixture
def key(tmp_path):
    made = run_toolkit("release", "key", tmp_path / "keys" / "current", "--no-passphrase")
    assert made.returncode == 0, made.stderr
    return tmp_path / "keys" / "current", made.stdout


def test_a_new_key_is_the_makers_alone_and_its_line_can_be_trusted(key):
    path, line = key
    assert path.stat().st_mode & 0o777 == 0o600
    assert path.parent.stat().st_mode & 0o777 == 0o700
    assert line.startswith('release@tsis namespaces="tsis-release" ssh-ed25519 AAAA')
    assert run_toolkit("release", "signers", f"{path}.pub").stdout == line


def test_two_keys_are_two_lines(key, tmp_path):
    path, line = key
    other = run_toolkit("release", "key", tmp_path / "keys" / "next", "--no-passphrase").stdout
    both = run_toolkit("release", "signers", f"{path}.pub", tmp_path / "keys" / "next.pub")
    assert both.stdout == line + other


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["build", "--machine", "riscv64"], "machine is 'riscv64', but must be one of aarch64, x86_64"),
        (["show", "none.release", "--signers", "none"], "write one with `host_tools release signers KEY.pub`"),
        (["signers", "none.pub"], "none.pub"),
    ],
    ids=["machine", "signers", "public key"],
)
def test_what_cannot_be_done_is_one_sentence_with_what_to_do(words, told, tmp_path):
    refused = run_toolkit("release", *words, cwd=tmp_path)
    assert (refused.returncode, refused.stdout) == (1, "")
    assert told in refused.stderr
