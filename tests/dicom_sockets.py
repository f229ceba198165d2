"""What the tests of the hospital's formats leave behind is let go of where it was made."""

import gc
import warnings
from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def no_sockets_left() -> Iterator[None]:
    """Collect sockets that pynetdicom leaves to the collector: their warning would fail whichever test comes next."""
    yield
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()
