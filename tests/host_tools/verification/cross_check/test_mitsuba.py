"""Mitsuba renders with the interpreter it is given, and names its failures."""

from __future__ import annotations

import stat
import sys
from pathlib import Path

import numpy as np
import pytest

from host_tools.optics.tracer import trace
from host_tools.verification.cross_check.mitsuba import (
    INTERPRETER_VARIABLE,
    MitsubaFailed,
    mitsuba_python,
    mitsuba_version,
    render_with_mitsuba,
)
from host_tools.verification.cross_check.mitsuba_scene import MitsubaCamera
from host_tools.verification.light.cross_check import BLOCK, SKIN, chapter, scene

# No continuous integration of ours installs it, so its absence is never a failure.
needs_mitsuba = pytest.mark.skipif(
    mitsuba_version(mitsuba_python()) is None, reason=f"Mitsuba is absent: let {INTERPRETER_VARIABLE} name one with it"
)


def program(path: Path, text: str) -> Path:
    """Write an executable that stands in for an interpreter."""
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


@needs_mitsuba
def test_mitsuba_sees_as_much_light_as_the_tracer() -> None:
    """Both noisy here: 37 000 paths of Mitsuba give the mean to some 3 %."""
    rendered = render_with_mitsuba(
        mitsuba_python(), BLOCK, scene(), SKIN, camera=MitsubaCamera(pixels=24), passes=4, samples=16
    )
    traced = trace(BLOCK, scene(), SKIN, rays=100_000)
    assert rendered.radiance.mean() == pytest.approx(traced.radiance.mean(), rel=0.1)


@needs_mitsuba
@pytest.mark.parametrize(("led_ratio", "axis"), [((1.0, 0.0, 0.0, 0.0), 1), ((0.0, 1.0, 0.0, 0.0), 0)])
def test_an_image_shows_x_by_column_and_y_by_row(led_ratio: tuple[float, float, float, float], axis: int) -> None:
    """The side of the one LED that is lit, +x or +y, is the brighter one."""
    camera = MitsubaCamera(pixels=24)
    rendered = render_with_mitsuba(
        mitsuba_python(), BLOCK, scene(), SKIN, led_ratio=led_ratio, camera=camera, passes=1, samples=64
    )
    far, _, near = np.split(rendered.radiance, 3, axis=axis)
    assert near.sum() > 1.5 * far.sum()
    assert np.isnan(rendered.noise).all()


def test_the_interpreter_is_the_chosen_one_then_the_environments_then_this_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(INTERPRETER_VARIABLE, "/there/python")
    assert mitsuba_python(Path("/here/python")) == Path("/here/python")
    assert mitsuba_python() == Path("/there/python")
    monkeypatch.delenv(INTERPRETER_VARIABLE)
    assert mitsuba_python() == Path(sys.executable)


@pytest.mark.parametrize("text", ["exit 1", None])
def test_an_interpreter_without_mitsuba_is_refused_with_what_to_install(text: str | None, tmp_path: Path) -> None:
    python = program(tmp_path / "python", text) if text else tmp_path / "missing"
    assert mitsuba_version(python) is None
    with pytest.raises(MitsubaFailed, match="install the package mitsuba"):
        render_with_mitsuba(python, BLOCK, scene(), SKIN)


def test_a_process_that_aborts_is_a_failure_with_its_last_words(tmp_path: Path) -> None:
    python = program(tmp_path / "python", '[ "$2" = -c ] && echo 9.9 && exit 0\necho LLVM ERROR >&2; kill -ABRT $$')
    with pytest.raises(MitsubaFailed, match=r"exit code -6, LLVM ERROR"):
        render_with_mitsuba(python, BLOCK, scene(), SKIN)


def test_a_run_over_its_time_limit_is_a_failure_that_says_so(tmp_path: Path) -> None:
    python = program(tmp_path / "python", '[ "$2" = -c ] && echo 9.9 && exit 0\nexec sleep 30')
    with pytest.raises(MitsubaFailed, match=r"longer than 0.2 s: allow more time"):
        render_with_mitsuba(python, BLOCK, scene(), SKIN, timeout_s=0.2)


def test_the_chapter_is_skipped_with_the_reason(tmp_path: Path) -> None:
    assert "not asked for" in chapter(1000, wanted=False).skipped
    assert "no package mitsuba" in chapter(1000, wanted=True, python=tmp_path / "missing").skipped


def test_a_failure_of_mitsuba_is_a_benchmark_that_fails(tmp_path: Path) -> None:
    python = program(tmp_path / "python", '[ "$2" = -c ] && echo 9.9 && exit 0\nexit 3')
    found = chapter(1000, wanted=True, python=python)
    assert not found.passed
    assert "exit code 3" in found.benchmarks[0].quantity
