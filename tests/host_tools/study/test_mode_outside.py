"""Shares of refused presses, with a model in whose place everything that it would say is made up."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from small_surrogate import white_noise

from device.measurement.mode import Mode
from device.measurement.press_profile import ROW_NAMES
from device.measurement.profile_model import Answer, ModeLimits, ProfileModel
from device.measurement.recording import CameraSettings, Recording
from device.measurement.tactile_image import Frame, Role
from host_tools.study.mode_outside import outside_chapter, refused_share
from host_tools.study.outside_presses import Kind

SIZE_PX, PITCH_MM, DARK = 96, 0.25, 1000
LIT = (0.6, 0.6, 0.6, 0.6)
AT_MM = (np.arange(SIZE_PX) - (SIZE_PX - 1) / 2) * PITCH_MM
X, Y = AT_MM[None, :], AT_MM[:, None]
SPOT = np.exp(-np.hypot(X, Y) / 5)
UNSEEN, PLAIN, MISFITTING = 0.0, 0.1, 0.3
"""Contrasts in the middle: the made-up model finds ten times the first column a misfit, of which 2 is usual."""


def frame(role: Role, force_n: float, counts: np.ndarray) -> Frame:
    return Frame(np.rint(counts).astype(np.uint16), role, 0.0, force_n, LIT)


def recording(contrast: np.ndarray) -> Recording:
    forces_n = [float(force) for force in np.linspace(0.08, 0.6, 8)]
    frames = [frame("dark", 0.0, np.full(SPOT.shape, DARK))]
    frames += [frame("reference", f, np.full(SPOT.shape, DARK + 60_000 * f)) for f in forces_n]
    frames += [frame("press", f, DARK + 60_000 * f * (1 + contrast)) for f in forces_n]
    camera = CameraSettings(SIZE_PX, SIZE_PX, 16, PITCH_MM, PITCH_MM, exposure_us=4000.0, gain=1.0)
    return Recording("one", "SIM", "test", "2026-01-01T00:00:00Z", camera, tuple(frames))


def spots(*contrasts: float) -> Kind:
    return Kind("spots", len(contrasts), lambda mode, i: recording(contrasts[i] * SPOT))


def made_up(beyond_deviations: float = 0.0) -> ProfileModel:
    def answer(row: np.ndarray, mode: Mode, mean: np.ndarray, spread: np.ndarray) -> Answer:
        return Answer(mean, spread, misfit_ratio=10 * float(row[0]), beyond_deviations=beyond_deviations)

    def networks(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        assert rows.shape[1] == len(ROW_NAMES)
        return np.zeros((len(rows), 3)), np.ones((len(rows), 3))

    limits = ModeLimits((), misfit_ratio=2.0, elongation_ratio=1.0)
    answers = SimpleNamespace(noise={"standard": white_noise(1e-3), "precise": white_noise(1e-3)}, answer=answer)
    fake: Any = SimpleNamespace(answers=answers, networks=networks, limits={"standard": limits, "precise": limits})
    return cast(ProfileModel, fake)


def share(kind: Kind, model: ProfileModel | None = None, **how: bool) -> float:
    return refused_share(model or made_up(), kind, "standard", jobs=1, **how)


def test_a_press_that_does_not_fit_is_refused_and_one_that_fits_is_not():
    assert share(spots(PLAIN, MISFITTING, PLAIN, PLAIN)) == 0.25


def test_a_lump_that_does_not_stand_out_is_refused_or_left_out():
    """Of five presses one shows nothing and one does not fit; left out, four are counted."""
    kind = spots(PLAIN, UNSEEN, MISFITTING, PLAIN, PLAIN)
    assert share(kind) == pytest.approx(2 / 5)
    assert share(kind, counts_unseen=False) == pytest.approx(1 / 4)


def test_a_lump_longer_one_way_is_refused():
    long = Kind("long", 1, lambda mode, i: recording(PLAIN * SPOT * (1 + 0.5 * np.cos(2 * np.arctan2(Y, X)))))
    assert (share(long), share(spots(PLAIN))) == (1.0, 0.0)


@pytest.mark.parametrize(("beyond_deviations", "expected"), [(2.9, 0.0), (3.1, 1.0)])
def test_a_lump_that_would_rather_lie_outside_its_range_is_refused(beyond_deviations, expected):
    assert share(spots(PLAIN), made_up(beyond_deviations)) == expected


def test_a_kind_is_recorded_in_the_mode_that_is_asked():
    asked: list[tuple[Mode, int]] = []

    def record(mode: Mode, number: int) -> Recording:
        asked.append((mode, number))
        return recording(PLAIN * SPOT)

    refused_share(made_up(), Kind("one", 2, record), "precise", jobs=1)
    assert asked == [("precise", 0), ("precise", 1)]


def test_few_of_the_first_kind_and_nearly_all_of_the_others_must_be_refused():
    """A chapter passes on a false share of 0 beside one of 1, and fails when both kinds change places."""
    good, strange = spots(PLAIN, PLAIN, UNSEEN), spots(MISFITTING, UNSEEN)
    chapter = outside_chapter(made_up(), [good, strange], ["standard", "precise"], jobs=1)
    assert [one.measured for one in chapter.benchmarks] == [0.0, 1.0, 0.0, 1.0]
    assert chapter.passed
    changed = outside_chapter(made_up(), [strange, good], ["standard"], jobs=1)
    assert [one.passed for one in changed.benchmarks] == [False, False]
