"""The comparison with Mitsuba tells a turned, a brighter and a blurred image from the same one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from host_tools.verification.light.cross_check import ImagePair, benchmarks

X_MM = np.linspace(-11.75, 11.75, 48)
IMAGE = np.exp(-((X_MM[None, :] - 4) ** 2 + (X_MM[:, None] - 1) ** 2) / 50)
SAME = ImagePair(X_MM, IMAGE, IMAGE, 0.0, 0.0, "3")


def failing(pair: ImagePair) -> list[str]:
    return [benchmark.quantity.split(",")[0] for benchmark in benchmarks(pair) if not benchmark.passed]


def test_the_same_image_holds_every_bound() -> None:
    assert failing(SAME) == []


@pytest.mark.parametrize(
    ("theirs", "missed"),
    [
        (IMAGE.T, ["correlation (at least)", "rms difference / peak"]),
        (1.02 * IMAGE, ["mean radiance"]),
        (IMAGE[:, ::-1], ["correlation (at least)", "rms difference / peak"]),
    ],
)
def test_another_image_misses_one(theirs: np.ndarray, missed: list[str]) -> None:
    found = failing(replace(SAME, theirs=theirs))
    assert set(missed) <= set(found)


def test_what_lies_beside_the_round_face_is_not_compared() -> None:
    corners = np.where(SAME.inside, IMAGE, 100.0)
    assert failing(replace(SAME, theirs=corners)) == []
