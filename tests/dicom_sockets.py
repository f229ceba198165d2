"""What the tests of the hospital's formats leave behind is let go of where it was made; their servers end at once."""

import gc
import warnings
from collections.abc import Iterator
from socketserver import BaseServer

import pytest

LOOK_EVERY_S = 0.02


@pytest.fixture(autouse=True)
def no_sockets_left(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Collect sockets that pynetdicom leaves to the collector: their warning would fail whichever test comes next.

    What was there before is none of them, and far more: it is not looked through. A server is told to end, as
    pynetdicom does it, and looks for that twice a second unless told otherwise; here oftener.
    """
    monkeypatch.setattr(BaseServer.serve_forever, "__defaults__", (LOOK_EVERY_S,))
    gc.freeze()
    yield
    _collect()
    gc.unfreeze()


@pytest.fixture(autouse=True, scope="module")
def no_sockets_left_of_file() -> Iterator[None]:
    """The same of what a whole file shares, which outlives its tests: once, of everything."""
    yield
    _collect()


def _collect() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()
