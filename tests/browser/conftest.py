"""What the tests in a browser share: one of each a module, for a start costs seconds."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from chromium import chromium_page
from playwright.sync_api import Browser, Page
from served_probe import ServedProbe, served_probe


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    """A page as large as the probe's panel."""
    with chromium_page() as page:
        yield page


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A browser for contexts of other sizes, languages and hands."""
    with chromium_page() as page:
        browser = page.context.browser
        assert browser is not None
        page.close()
        yield browser


@pytest.fixture(scope="module")
def probe(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedProbe]:
    """A simulated probe that stays in the state that a test writes on its board."""
    with served_probe(tmp_path_factory.mktemp("probe"), is_running=False) as served:
        yield served
