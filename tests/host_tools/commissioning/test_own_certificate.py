"""The certificate of a commissioned probe: its own face and camera, how long it holds, and what keeps it from being."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from toolkit_process import run_toolkit

from device.files.recording_file import write_recording
from device.files.shipped import SIMULATED_PROBE
from device.measurement.calibration import calibration_of
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.camera_geometry import CameraGeometry
from host_tools.calibration.gates import CalibrationRejected
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.commissioning import commission as commission_module
from host_tools.commissioning.own_certificate import own_certificate, validity_of
from host_tools.press_models.recorded_presses import EXACT, drifted
from host_tools.scenes.phantom_set import read_phantoms
from host_tools.scenes.probe_file import NAME, simulated_probe

RAMP = PhantomProtocol(tuple(np.linspace(0.1, 0.6, 6)), frames=1)
MADE_AT = "2026-11-02T12:00:00Z"


@pytest.fixture(scope="module")
def recordings(tables):
    inclusions = Inclusion(10.0, 6.0, 80.0), Inclusion(12.0, 5.0, 60.0)
    return [phantom_recording(one, tables, seed=7 + n, protocol=RAMP) for n, one in enumerate(inclusions)]


def certified(recordings, names=("A1", "A2"), probe=None, valid_days=365, block_names=()):
    return own_certificate(
        recordings,
        names,
        probe or simulated_probe(),
        phantom_serial="PH-7",
        operator="N. N.",
        made_at=MADE_AT,
        valid_days=valid_days,
        block_names=block_names,
    )


def test_it_is_for_the_probe_with_the_cameras_geometry_of_its_file_and_has_no_lines(recordings):
    probe = simulated_probe()
    moved = replace(probe, camera=replace(probe.camera, axis_x_mm=0.3))
    made = certified(recordings, probe=moved)
    assert (made.serial, made.phantom_serial, made.phantoms, made.operator) == ("SIM-0001", "PH-7", 2, "N. N.")
    assert made.camera.geometry == moved.geometry != recordings[0].camera.geometry
    assert made.camera.exposure_us == recordings[0].camera.exposure_us
    assert made.cell == recordings[0].cell
    assert made.lines is None
    assert certified(recordings, probe=moved).id == made.id


def test_drift_is_watched_by_the_untouched_frames_of_the_ramps(recordings):
    untouched = certified(recordings).untouched
    unloaded = [frame for frame in recordings[0].frames if frame.role != "press" and frame.force_n < 0.01]
    drift = untouched.drift(unloaded)
    assert abs(drift.change_ratio) < 0.01
    brighter = [replace(one, counts=one.counts + np.uint8(30 * any(one.led_ratio))) for one in unloaded]
    assert untouched.drift(brighter).change_ratio > 0.25


def test_blocks_tell_by_how_much_two_presses_differ_and_without_one_it_says_nothing(recordings, tables):
    """A smooth error of 0.4 % of the light; each block shows some thirty independent parts of it."""
    levels = replace(EXACT, flat_field_ratio=0.004)
    on_blocks = [
        drifted(
            phantom_recording(Inclusion(0.0, 6.0, 80.0), tables, seed=n, protocol=RAMP),
            np.random.default_rng(n),
            levels,
        )
        for n in range(6)
    ]
    names = ["A1", "A2", *(f"B{n}" for n in range(6))]
    made = certified([*recordings, *on_blocks], names, block_names=names[2:])
    assert made.flat_field_ratio == pytest.approx(0.004, rel=0.25)
    assert calibration_of(made.to_json().encode(), Path("made.json")) == made
    assert certified(recordings).flat_field_ratio is None
    assert "flat_field_ratio" not in certified(recordings).summary()


@pytest.mark.parametrize(
    ("simulated", "started_at", "expires_at"),
    [(True, "1970-01-01T00:00:00Z", "2027-11-02T12:00:00Z"), (False, "2026-10-01T08:00:00Z", "2027-10-01T08:00:00Z")],
)
def test_it_is_as_old_as_its_oldest_recording_but_for_simulated_ones(recordings, simulated, started_at, expires_at):
    first, second = (replace(one, simulated=simulated, started_at="2026-10-20T08:00:00Z") for one in recordings)
    made = certified([first, replace(second, started_at=started_at)])
    assert (made.validity.measured_at, made.validity.expires_at) == (started_at, expires_at)


def test_everything_that_recordings_lack_is_named_with_their_phantoms(recordings):
    first, second = recordings
    pressed_only = tuple(one for one in second.frames if one.role == "press" or one.force_n > 0.01)
    with pytest.raises(CalibrationRejected) as rejected:
        certified([replace(first, cell=None), replace(second, frames=pressed_only)])
    told = [problem.quantity for problem in rejected.value.problems]
    assert told == ["cell of A1", "dark frames of A2"]


def test_recordings_that_are_too_old_or_of_two_cameras_make_none(recordings):
    first, second = (replace(one, simulated=False, started_at="2024-01-01T00:00:00Z") for one in recordings)
    with pytest.raises(CalibrationRejected) as rejected:
        certified([first, replace(second, camera=replace(second.camera, gain=2.0))])
    assert {problem.quantity for problem in rejected.value.problems} == {"camera", "age of the oldest recording"}


def test_recordings_of_one_camera_whose_geometry_was_told_in_between_make_one(recordings):
    first, second = recordings
    known = CameraGeometry(second.camera.scale, axis_y_mm=0.1)
    assert certified([first, replace(second, camera=second.camera.seen_as(known))])


@pytest.mark.parametrize(("tares", "told"), [((None, 8200.0), 8200.0), ((8190.0, 8200.0), None)])
def test_a_tare_or_a_set_that_only_some_recordings_say_keeps_none_from_being_made(recordings, tares, told):
    first, second = (
        replace(one, cell=replace(one.cell, tare_counts=tare), phantom_serial=serial)
        for one, tare, serial in zip(recordings, tares, ("", "PH-7"), strict=True)
    )
    made = certified([first, second])
    assert (made.cell.tare_counts, made.phantom_serial) == (told, "PH-7")
    assert made.cell.counts_per_n == recordings[0].cell.counts_per_n


@pytest.fixture
def commissioned(recordings, tmp_path, monkeypatch):
    """Run the command on changed recordings of each phantom; what would be computed of the ramps is left out."""

    def no_further(*ramps, **options):
        raise CalibrationRejected([InvalidQuantity("computing", "left out", "done", "not in this test")])

    monkeypatch.setattr(commission_module, "commission", no_further)
    file = SIMULATED_PROBE / "phantoms.toml"

    def run(recording, *options):
        *frames, last = recording.frames
        for number, one in enumerate(read_phantoms(file).phantoms):
            counts = last.counts.copy()
            counts[0, number] ^= 1  # each is another press
            made = replace(recording, frames=(*frames, replace(last, counts=counts)))
            write_recording(replace(made, id=one.name, truth=one.inclusion), tmp_path / "ramps" / one.name)
        ramps, files = sorted((tmp_path / "ramps").iterdir()), ("--probe", SIMULATED_PROBE / NAME, "--phantoms", file)
        told = run_toolkit("commission", *ramps, *files, "--out", tmp_path / "own", *options)
        assert (told.returncode, (tmp_path / "own").exists()) == (1, False)
        return told.stderr

    return run


@pytest.mark.parametrize(("option", "is_computed"), [((), False), (("--no-certificate",), True)], ids=["asked", "not"])
def test_recordings_that_lack_what_a_certificate_says_are_refused_unless_none_is_asked_for(
    recordings, commissioned, option, is_computed
):
    """Here no frame shows the untouched face."""
    touched = tuple(frame for frame in recordings[0].frames if frame.role != "reference" or frame.force_n > 0.01)
    told = commissioned(replace(recordings[0], frames=touched), *option)
    assert "The recordings make no certificate" in told
    assert "lit unloaded frames of block1 is 0, but must be at least one" in told
    assert "lit unloaded frames of phantom9" in told
    assert ("computing is left out" in told) is is_computed


def test_recordings_that_are_too_old_are_refused_whatever_is_asked_for(recordings, commissioned):
    old = replace(recordings[0], simulated=False, started_at="2024-01-01T00:00:00Z")
    told = commissioned(old, "--no-certificate")
    assert "age of the oldest recording is " in told
    assert "computing is left out" not in told


def test_bundles_hold_from_the_oldest_recording(recordings):
    first, second = (replace(one, simulated=False, started_at="2026-10-20T08:00:00Z") for one in recordings)
    older = replace(second, started_at="2026-10-01T08:00:00Z")
    assert validity_of([first, older], MADE_AT, 365).expires_at == "2027-10-01T08:00:00Z"
