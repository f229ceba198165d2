"""Keys and signatures of releases, made and checked by `ssh-keygen` alone.

A key is an OpenSSH key, in a file or in a hardware token; a probe trusts those that its list of signers names. OpenSSH
is on every probe and every workstation, works without a network, and its verification reads no clock. The Update
Framework would add freshness and mirrors, which a file that a person carries does not have.
Source: ssh-keygen(1), sections on -Y sign and ALLOWED SIGNERS; PROTOCOL.sshsig of OpenSSH.
"""

from __future__ import annotations

import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from device.errors import DeviceError
from device.measurement.quantities import InvalidQuantity
from device.update.signature import IDENTITY, NAMESPACE, require_signature


def new_key(path: Path, *, hardware: bool = False, passphrase: str | None = None) -> Path:
    """Make a key in a new file, `path`, its public half in `path`.pub; return the public one.

    In a hardware token when `hardware` says so. ssh-keygen asks for the passphrase unless one is given. Raises
    `InvalidQuantity` for a place in a git repository, where keys get committed, or one that is taken.
    """
    if path.exists():
        raise InvalidQuantity("key", path, "a file that is not there yet", "give another name: no key is replaced")
    repository = repository_of(path)
    if repository:
        raise InvalidQuantity("key", path, f"outside the repository {repository}", "give another place")
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    kind = "ed25519-sk" if hardware else "ed25519"
    words = ["-t", kind, "-C", IDENTITY, "-f", str(path)]
    if passphrase is not None:
        words += ["-q", "-N", passphrase]
    if subprocess.run(["ssh-keygen", *words], check=False).returncode:
        raise InvalidQuantity("key", path, "a new key", "see what ssh-keygen says")
    return path.with_name(f"{path.name}.pub")


def signers_list(public_keys: list[Path]) -> str:
    """Return the list of signers that trusts some public keys, the form of `/etc/tsis/release_signers`."""
    lines = []
    for path in public_keys:
        words = path.read_text(encoding="utf-8").split()
        if len(words) < 2 or "PRIVATE" in words or not words[0].startswith(("ssh-", "sk-ssh-", "ecdsa-")):
            raise InvalidQuantity(
                "public key", path, "a line as `ssh-ed25519 AAAA...`", "give the file that ends in .pub"
            )
        lines.append(f'{IDENTITY} namespaces="{NAMESPACE}" {words[0]} {words[1]}\n')
    return "".join(lines)


def signature_of(content: bytes, key: Path) -> bytes:
    """Return the signature of a manifest by the private key in a file, or by the agent's if that file is public.

    Raises `InvalidQuantity` for a key in a git repository, and with what ssh-keygen says when it cannot sign.
    """
    if not key.is_file():
        raise InvalidQuantity("key", key, "the file of a key", f"make one with `host_tools release key {key}`")
    repository = repository_of(key)
    if repository and key.suffix != ".pub":
        raise InvalidQuantity("key", key, f"outside the repository {repository}", "move it out, and make a new one")
    with TemporaryDirectory() as folder:
        signed = Path(folder, "manifest.json")
        signed.write_bytes(content)
        words = ["ssh-keygen", "-q", "-Y", "sign", "-f", str(key), "-n", NAMESPACE, str(signed)]
        done = subprocess.run(words, stderr=subprocess.PIPE, text=True, check=False)  # it may ask for a passphrase
        if done.returncode:
            raise InvalidQuantity("key", key, "one that signs", f"ssh-keygen says: {done.stderr.strip()}")
        return signed.with_name("manifest.json.sig").read_bytes()


def require_signed(content: bytes, signature: bytes, signers: str) -> None:
    """Raise `InvalidQuantity` unless a key of a list of signers has signed a manifest, as a probe would find."""
    with TemporaryDirectory() as folder:
        trusted = Path(folder, "release_signers")
        trusted.write_text(signers, encoding="utf-8")
        try:
            require_signature(content, signature, trusted)
        except DeviceError as error:
            bound = "of a key in the list of signers"
            raise InvalidQuantity("signature", "not what a probe takes", bound, str(error)) from error


def repository_of(path: Path) -> Path | None:
    """Return the git repository that a path lies in, if any."""
    return next((folder for folder in path.resolve().parents if (folder / ".git").exists()), None)
