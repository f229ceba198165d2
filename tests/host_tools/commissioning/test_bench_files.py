"""What is wrong with the files of a commissioning is told together, by the command, too, and nothing is written."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from toolkit_process import run_toolkit

from device.files.recording_file import read_recording, remove_recording, write_recording
from device.files.shipped import SIMULATED_PROBE
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.commissioned.row_derivatives import NAMES
from host_tools.calibration.gates import CalibrationRejected
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.calibration.phantom_sets import of_file
from host_tools.commissioning.bench_files import read_bench
from host_tools.commissioning.own_bundle import quick_folder
from host_tools.commissioning.probe_prior import SPAN
from host_tools.scenes.phantom_set import read_phantoms
from host_tools.scenes.probe_file import probe_text, simulated_probe

DESIGN, PHANTOMS = simulated_probe(), SIMULATED_PROBE / "phantoms.toml"
SMALL = replace(
    DESIGN,
    serial="TSIS-0007",
    camera=replace(DESIGN.camera, width_px=104, height_px=68, mm_per_px_x=0.23, mm_per_px_y=0.26),
    cell=replace(DESIGN.cell, counts_per_n=100_500.0),
)
"""A probe of the design with a camera of few pixels, and a cell that was measured after the recordings."""
RAMP_N = tuple(map(float, np.linspace(0.1, 0.64, 8)))


@pytest.fixture(scope="module")
def taken(tables):
    """Recordings of the small probe on each phantom, by its name."""
    made_by = replace(SMALL, cell=DESIGN.cell)
    protocol = PhantomProtocol(RAMP_N, frames=1)
    return {
        one.name: replace(
            phantom_recording(one.inclusion, tables, seed=seed, protocol=protocol, probe=made_by), truth=one.truth
        )
        for seed, one in enumerate(of_file(read_phantoms(PHANTOMS)), start=4)
    }


@pytest.fixture
def bench(taken, tmp_path):
    """Files of the small probe and of its recordings."""
    probe = tmp_path / "probe.toml"
    probe.write_text(probe_text(SMALL))
    for name, recording in taken.items():
        write_recording(recording, tmp_path / "ramps" / name)
    return tmp_path


def ramps_in(folder):
    return sorted((folder / "ramps").iterdir())


def recorded(folder, name):
    return read_recording(folder / "ramps" / name)


def replaced(folder, name, **changes):
    """Change a recording on the disk."""
    changed, path = replace(recorded(folder, name), **changes), folder / "ramps" / name
    remove_recording(path)
    write_recording(changed, path)


def told(folder, probe=None, phantoms=PHANTOMS):
    with pytest.raises(CalibrationRejected) as rejected:
        read_bench(ramps_in(folder), probe or folder / "probe.toml", phantoms, DESIGN)
    return [problem.quantity for problem in rejected.value.problems]


def test_a_bench_is_read_with_the_cell_that_took_its_forces(bench):
    found = read_bench(ramps_in(bench), bench / "probe.toml", PHANTOMS, DESIGN)
    assert {ramp.name for ramp in found.ramps} == {path.name for path in ramps_in(bench)}
    assert found.prior.mean[NAMES.index(SPAN)] == pytest.approx(0.005)
    assert (found.probe.serial, found.phantoms.serial) == ("TSIS-0007", read_phantoms(PHANTOMS).serial)


def test_all_that_is_wrong_with_files_that_hold_alone_is_told_at_once(bench):
    """Another design, another probe, another truth, another ramp, another cell, another set, and one that is broken."""
    replaced(bench, "phantom1", truth=Inclusion(14.0, 5.0, 60.0))
    replaced(bench, "phantom2", serial="TSIS-0009", phantom_serial="PH-99")
    short = [frame for frame in recorded(bench, "phantom3").frames if frame.force_n < 0.5]
    replaced(bench, "phantom3", frames=tuple(short))
    (bench / "ramps" / "phantom4" / "recording.json").write_text("{")
    replaced(bench, "phantom5", cell=replace(recorded(bench, "phantom5").cell, counts_per_n=100_400.0))
    (bench / "ramps" / "phantom6").rename(bench / "ramps" / "nobody")
    other = replace(
        SMALL,
        face=replace(SMALL.face, radius_mm=9.0),
        layers=(replace(SMALL.layers[0], youngs_modulus_kpa=90.0), *SMALL.layers[1:]),
    )
    (bench / "probe.toml").write_text(probe_text(other))
    found = told(bench)
    assert found == [
        "face.radius_mm",
        "layers[0].youngs_modulus_kpa",
        f"{bench / 'ramps' / 'phantom4'}: recording",
        "serial of phantom2",
        "counts_per_n of the recordings",
        "phantom of nobody",
        "truth of phantom1",
        "phantom_serial of phantom2",
        "phantom3: largest reference force",
    ]


def without_tolerance(text, key):
    """Return a file in which the first tolerance of a key is 0."""
    before, _, after = text.partition(f"\n{key}_tolerance = ")
    return f"{before}\n{key}_tolerance = 0.0\n{after.partition(chr(10))[2]}"


def test_tolerances_of_zero_in_both_files_are_told_beside_what_is_wrong_with_recordings(bench):
    probe, phantoms = bench / "probe.toml", bench / "phantoms.toml"
    probe.write_text(without_tolerance(probe.read_text(), "counts_per_n"))
    phantoms.write_text(without_tolerance(PHANTOMS.read_text(), "tissue_modulus_kpa"))
    (bench / "ramps" / "phantom4" / "recording.json").unlink()
    found = told(bench, phantoms=phantoms)
    assert found == [
        "cell.counts_per_n_tolerance",
        "phantoms[0].tissue_modulus_kpa_tolerance",
        f"{bench / 'ramps' / 'phantom4'}: recording",
    ]


def commissioned(folder, *options):
    files = ("--probe", folder / "probe.toml", "--phantoms", PHANTOMS, "--out", folder / "own")
    return run_toolkit("commission", *ramps_in(folder), *files, *options)


def test_the_command_tells_all_at_once_and_writes_nothing(bench):
    replaced(bench, "phantom1", truth=Inclusion(14.0, 5.0, 60.0))
    for path in ramps_in(bench)[-3:]:
        (path / "recording.json").unlink()
    done = commissioned(bench)
    assert (done.returncode, done.stdout) == (1, "")
    assert len(done.stderr.splitlines()) == 4
    assert "truth of phantom1 is 14 mm, 5 mm deep, 60 kPa" in done.stderr
    assert "if the file was corrected since, remove `truth` from its recording.json" in done.stderr
    assert not (bench / "own").exists()


def test_the_command_tells_all_as_json_of_files_that_do_not_hold_too(bench):
    probe = bench / "probe.toml"
    probe.write_text(without_tolerance(probe.read_text(), "counts_per_n"))
    replaced(bench, "phantom1", truth=Inclusion(14.0, 5.0, 60.0))
    done = commissioned(bench, "--json")
    said = json.loads(done.stdout)
    assert (done.returncode, said["accepted"]) == (1, False)
    assert [one["quantity"] for one in said["problems"]] == ["cell.counts_per_n_tolerance", "truth of phantom1"]
    assert not (bench / "own").exists()


def test_a_scheduler_that_is_not_there_is_told_before_anything_is_computed(bench):
    done = commissioned(bench, "--scheduler", "tcp://127.0.0.1:1")
    assert done.returncode == 1
    assert "scheduler" in done.stderr
    assert not (bench / "own").exists()


def test_neither_of_the_two_bundles_is_replaced_and_one_that_is_not_made_is_in_no_ones_way(bench):
    (bench / "own-quick").mkdir()
    done = commissioned(bench)
    assert done.returncode == 1
    assert f"bundle is {bench / 'own-quick'}, but must be a new folder" in done.stderr
    replaced(bench, "phantom1", truth=Inclusion(14.0, 5.0, 60.0))
    assert "truth of phantom1" in commissioned(bench, "--no-quick").stderr


def test_the_bundle_of_mode_quick_stands_beside_the_other_wherever_that_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert quick_folder(Path(".")) == tmp_path.with_name(f"{tmp_path.name}-quick")
    assert quick_folder(Path("models/own")) == tmp_path / "models" / "own-quick"
