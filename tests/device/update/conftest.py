"""A probe with one key that it trusts; a second and an evil key beside it."""

import pytest
from small_release import new_key
from updated_probe import UpdatedProbe


@pytest.fixture(scope="session")
def keys(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys")
    return {name: new_key(folder, name) for name in ("good", "next", "evil")}


@pytest.fixture
def probe(tmp_path, keys):
    made = UpdatedProbe(tmp_path, keys["good"])
    yield made
    made.stop()
