"""Scenes of foreign probes: the committed ones are those of the command, and every one of them can be pressed."""

import statistics
from pathlib import Path

import numpy as np
import pytest
from daemon_process import ROOT
from typer.testing import CliRunner

from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.pixel_scale import PixelScale
from device.simulation.hand import BESIDE_MM
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.physics.world import AS_BELIEVED
from device.simulation.scenario import Scenario, read_scenario
from device.simulation.virtual_probe import VirtualProbe
from host_tools.__main__ import app
from host_tools.scores.foreign_probes import foreign_world

WORLDS = ROOT / "scenarios" / "worlds"
NAMES = [f"world_{number:02}.toml" for number in range(1, 21)]


def written(out: Path, *words: str) -> dict[str, bytes]:
    done = CliRunner().invoke(app, ["worlds", "--out", str(out), *words], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return {path.name: path.read_bytes() for path in sorted(out.iterdir())}


def test_the_committed_worlds_are_the_commands_byte_for_byte(tmp_path):
    committed = {path.name: path.read_bytes() for path in sorted(WORLDS.iterdir())}
    assert list(committed) == NAMES
    assert written(tmp_path, "--count", "20", "--seed", "1") == committed


def test_a_world_depends_on_seed_and_number_alone(tmp_path):
    few, many = (written(tmp_path / count, "--count", count, "--seed", "7") for count in ("2", "3"))
    assert few == {name: many[name] for name in few}
    assert few != written(tmp_path / "other", "--count", "2", "--seed", "8")


def test_worlds_of_another_seed_do_not_stay_beside(tmp_path):
    before = written(tmp_path, "--count", "3", "--seed", "1")
    done = CliRunner().invoke(app, ["worlds", "--out", str(tmp_path), "--count", "1", "--seed", "2"])
    assert isinstance(done.exception, InvalidQuantity)
    assert "in a folder without world_02.toml, world_03.toml" in str(done.exception)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    assert list(written(tmp_path, "--count", "3", "--seed", "2")) == list(before)


@pytest.mark.parametrize("name", NAMES)
def test_a_foreign_probe_is_read_and_shows_other_presses_than_the_believed(tables, name):
    """Frames of both presses; as much as the noise at least, and no more than another probe may."""
    scene, scale, frames = read_scenario(WORLDS / name), PixelScale(0.125, 0.146), []
    for one in (scene, Scenario()):
        probe = VirtualProbe(one, tables, (123, 193), scale)
        frames.append([
            probe.frame_counts(
                force_n=0.5, place=place, led_ratio=(0.6,) * 4, exposure_us=4000.0, gain=1.0, frame_number=1
            ).astype(float)
            for place in (ProbePlacement(), ProbePlacement(*BESIDE_MM))
        ])  # fmt: skip
    foreign, believed = np.array(frames)[:, :, 40:83, 70:123].mean(axis=(2, 3))
    assert (np.abs(foreign / believed - 1) < 0.25).all()
    assert np.abs(np.subtract(*np.array(frames))).mean() > 1.0


def test_tolerances_are_standard_deviations_cut_at_two():
    """Of a thousand worlds: 0.88 of the tolerance, which is what the cut leaves of a normal one."""
    worlds = [foreign_world(1, number) for number in range(1000)]
    for drawn, tolerance in (
        ([world.contact.exponent - 1 for world in worlds], 0.1),
        ([world.camera.axis_y_mm for world in worlds], 0.3),
        ([world.layers.middle_modulus_ratio - 1 for world in worlds], 0.1),
        ([world.tilt.beside_x_deg for world in worlds], 0.3),
    ):
        assert max(map(abs, drawn)) <= 2 * tolerance
        assert statistics.fmean(drawn) == pytest.approx(0.0, abs=0.1 * tolerance)
        assert statistics.stdev(drawn) == pytest.approx(0.88 * tolerance, rel=0.07)
    assert AS_BELIEVED not in worlds


def test_no_world_at_all_is_refused(tmp_path):
    with pytest.raises(InvalidQuantity, match="count is 0, but must be at least 1"):
        CliRunner().invoke(app, ["worlds", "--count", "0", "--out", str(tmp_path / "none")], catch_exceptions=False)
    assert not (tmp_path / "none").exists()
