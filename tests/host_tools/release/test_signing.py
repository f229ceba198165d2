"""With throw-away keys; ssh-keygen is that of this machine."""

import subprocess

import pytest
from daemon_process import ROOT

from device.measurement.quantities import InvalidQuantity
from host_tools.release.signing import new_key, require_signed, signature_of, signers_list

CONTENT = b'{"schema": "tsis.release/1"}\n'


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    """Two private keys."""
    folder = tmp_path_factory.mktemp("keys")
    for name in ("current", "next"):
        new_key(folder / name, passphrase="")
    return folder / "current", folder / "next"


def public(key):
    return key.with_name(f"{key.name}.pub")


def test_a_list_of_two_keys_trusts_both_and_no_third(keys, tmp_path):
    both = signers_list([public(key) for key in keys])
    for key in keys:
        require_signed(CONTENT, signature_of(CONTENT, key), both)
    stranger = new_key(tmp_path / "stranger", passphrase="").with_suffix("")
    with pytest.raises(
        InvalidQuantity, match="signature is not what a probe takes, but must be of a key in the list of signers"
    ):
        require_signed(CONTENT, signature_of(CONTENT, stranger), both)
    with pytest.raises(InvalidQuantity, match="signature is not what a probe takes"):
        require_signed(CONTENT, signature_of(CONTENT, keys[1]), signers_list([public(keys[0])]))


def test_a_signature_is_of_these_bytes_and_for_this_purpose(keys, tmp_path):
    trusted, signature = signers_list([public(keys[0])]), signature_of(CONTENT, keys[0])
    with pytest.raises(InvalidQuantity, match="signature"):
        require_signed(CONTENT + b" ", signature, trusted)
    (tmp_path / "m").write_bytes(CONTENT)
    subprocess.run(["ssh-keygen", "-q", "-Y", "sign", "-f", keys[0], "-n", "file", tmp_path / "m"], check=True)
    with pytest.raises(InvalidQuantity, match="signature"):
        require_signed(CONTENT, (tmp_path / "m.sig").read_bytes(), trusted)


def test_a_list_with_a_date_is_refused_for_a_probe_has_no_clock(keys):
    dated = signers_list([public(keys[0])]).replace(" ssh-", ',valid-before="20990101" ssh-')
    with pytest.raises(InvalidQuantity, match="has a date, which the probe's clock cannot keep"):
        require_signed(CONTENT, signature_of(CONTENT, keys[0]), dated)


def test_the_same_bytes_and_key_give_the_same_signature(keys):
    assert signature_of(CONTENT, keys[0]) == signature_of(CONTENT, keys[0])


def test_a_key_is_never_made_in_a_repository_nor_over_another(keys):
    with pytest.raises(InvalidQuantity, match="must be outside the repository"):
        new_key(ROOT / "build" / "release_key", passphrase="")
    before = keys[0].read_bytes()
    with pytest.raises(InvalidQuantity, match="no key is replaced"):
        new_key(keys[0], passphrase="")
    assert keys[0].read_bytes() == before


def test_a_key_in_a_repository_signs_nothing(keys, tmp_path):
    (tmp_path / ".git").mkdir()
    key = tmp_path / "key"
    key.write_bytes(keys[0].read_bytes())
    key.chmod(0o600)
    with pytest.raises(InvalidQuantity, match="must be outside the repository"):
        signature_of(CONTENT, key)


def test_a_missing_key_and_one_that_is_none_are_told_apart(tmp_path):
    with pytest.raises(InvalidQuantity, match=r"make one with `host_tools release key"):
        signature_of(CONTENT, tmp_path / "none")
    (tmp_path / "text").write_text("no key\n")
    with pytest.raises(InvalidQuantity, match="ssh-keygen says: .+"):
        signature_of(CONTENT, tmp_path / "text")


def test_a_private_key_does_not_get_into_a_list_of_signers(keys):
    with pytest.raises(InvalidQuantity, match=r"give the file that ends in \.pub"):
        signers_list([keys[0]])


def test_no_file_of_the_repository_is_a_private_key():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout
    begin = b"-----BEGIN "  # in two parts, so that this file is none
    for name in filter(None, listed.decode().split("\0")):
        path = ROOT / name
        if path.is_file():
            lines = path.read_bytes().splitlines()
            assert not [line for line in lines if line.startswith(begin) and b"PRIVATE KEY" in line], name
