"""Tokens: shown once, kept as hashes, and at an end when they say so or are revoked."""

import sqlite3
from contextlib import closing
from datetime import UTC, datetime, timedelta

import pytest

from device.errors import UnknownResource
from device.records.store import Store


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


def test_a_fresh_probe_has_no_token(store):
    assert store.tokens.all() == []
    assert store.tokens.of("") is None
    assert store.tokens.of("admin") is None


def test_a_token_is_known_by_its_secret_also_after_a_restart(store):
    made, secret = store.tokens.make("PACS", "read", days=3)
    store.close()
    again = Store(store.folder)
    assert again.tokens.of(secret) == made
    assert (made.name, made.scope, made.revoked_at) == ("PACS", "read", None)
    assert again.tokens.of(secret + "x") is None
    again.close()


def test_no_two_are_alike_and_each_has_256_bits(store):
    secrets = {store.tokens.make("PC", "read", days=1)[1] for _ in range(20)}
    assert len(secrets) == 20
    assert {len(secret.removeprefix("tsis_")) for secret in secrets} == {43}  # 32 bytes in base64


def test_the_secret_is_nowhere_on_the_disk(store):
    _, secret = store.tokens.make("PACS", "admin", days=3)
    store.close()
    content = b"".join(path.read_bytes() for path in store.folder.rglob("*") if path.is_file())
    assert b"PACS" in content
    assert secret.encode() not in content
    assert secret.removeprefix("tsis_").encode() not in content


def test_a_revoked_token_is_none_and_its_listeners_hear_of_it(store):
    told = []
    store.tokens.on_revoked(told.append)
    made, secret = store.tokens.make("PACS", "read", days=3)
    other, kept = store.tokens.make("PC", "read", days=3)
    store.tokens.revoke(made.id)
    assert told == [made.id]
    assert store.tokens.of(secret) is None
    assert store.tokens.of(kept) == other
    with pytest.raises(UnknownResource, match="no token .* that holds"):
        store.tokens.revoke(made.id)
    store.close()
    again = Store(store.folder)
    assert again.tokens.of(secret) is None
    assert {one.id for one in again.tokens.all()} == {made.id, other.id}
    again.close()


def test_an_expired_token_is_none(store):
    made, secret = store.tokens.make("PACS", "read", days=3)
    store.close()
    past = (datetime.now(UTC) - timedelta(seconds=1)).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    with closing(sqlite3.connect(store.folder / "tsis.sqlite")) as db:
        db.execute("UPDATE token SET expires_at = ? WHERE id = ?", (past, made.id))
        db.commit()
    again = Store(store.folder)
    assert again.tokens.of(secret) is None
    again.close()


def test_a_token_says_how_long_it_holds(store):
    assert 86_000 < store.tokens.make("PC", "read", days=1)[0].left_s <= 86_400
    assert store.tokens.make("PC", "read", days=0)[0].left_s == 0.0


def test_a_record_has_no_hash(store):
    made, _ = store.tokens.make("PACS", "read", days=3)
    assert set(made.as_record()) == {"id", "name", "scope", "made_at", "expires_at", "revoked_at"}
