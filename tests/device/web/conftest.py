"""A store, and its lists and files over REST without a probe."""

import asyncio
import types

import httpx
import pytest

from device.records.store import Store
from device.web.app import create_app


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


@pytest.fixture
def get(store):
    """Ask the own screen's API, by a path below /api/v1."""
    app = create_app(types.SimpleNamespace(config=types.SimpleNamespace(serial="P-1")), store)

    def getting(path, **query):
        async def answer():
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
                return await client.get(f"/api/v1/{path}", params=query)

        return asyncio.run(answer())

    return getting
