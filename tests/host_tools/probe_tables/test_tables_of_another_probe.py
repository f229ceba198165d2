"""Tables of another probe: solved for its layers, known by its hash, and refused beside the simulated probe's."""

import json
import shutil
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from toolkit_process import run_toolkit

from device.files.recording_file import read_recording
from device.files.shipped import SIMULATED_PROBE
from device.measurement.quantities import InvalidQuantity
from device.simulation.physics.off_axis_table import load_off_axis_table
from device.simulation.physics.slab import NOMINAL
from device.simulation.physics.surface_table import load_surface_table
from device.simulation.virtual_probe import SIMULATED_PROBE_SHA256, ProbeTables, probe_of_table, table_record
from host_tools.forward.plan import Level
from host_tools.optics.build_lookup import write_light_table
from host_tools.probe_tables import aside_changes, off_axis_table, slab_changes, surface_table
from host_tools.probe_tables.cosine_modes import MODES
from host_tools.probe_tables.force_ramps import FORCES_N, bare_per_n, scene_in
from host_tools.scenes.probe_file import probe_text, simulated_probe
from host_tools.scenes.scene import Waveguide

OWN = simulated_probe()
STIFFER = replace(
    OWN,
    serial="TSIS-0007",
    layers=tuple(replace(layer, youngs_modulus_kpa=1.25 * layer.youngs_modulus_kpa) for layer in OWN.layers),
)
QUICK = (Level("blunt", 3),)
"""A level of quick solves: both probes' are on it."""
NAMES = ("surface_table", "off_axis_table", "light_table")


def once(monkeypatch, module, name):
    """Let a solve of a table stand for all others: a table of one point, as large as one of eight."""
    solve, found = getattr(module, name), []

    def first(*arguments):
        if not found:
            found.append(solve(*arguments))
        return found[0]

    monkeypatch.setattr(module, name, first)


def unsolved(monkeypatch, module, name, shape):
    """Let noise stand for a solve whose fields nobody looks at, once it was asked for under the stiffer waveguide."""
    noise = np.random.default_rng(1).standard_normal(shape)

    def asked(*arguments):
        told = [one.keywords["waveguide"] if isinstance(one, partial) else one for one in arguments]
        assert any(isinstance(one, Waveguide) and one == STIFFER.waveguide for one in told)
        return noise

    monkeypatch.setattr(module, name, asked)


@pytest.fixture
def built(monkeypatch, tmp_path):
    """The folder of the stiffer probe's mechanical tables: solved for without an inclusion and for one tilt alone."""
    committed, aside = load_surface_table(SIMULATED_PROBE), load_off_axis_table(SIMULATED_PROBE)
    of_force, of_face = (2, len(FORCES_N), len(committed.r_mm)), (2, MODES, len(aside.r_mm))
    for module, name, shape in (
        (surface_table, "inclusions_per_n_mm3", (2, *of_force)),
        (slab_changes, "slab_change_per_n", of_force),
        (slab_changes, "inclusion_in_slabs", (1 + slab_changes.SLABS_A_PLACE, 2, *of_force)),
        (off_axis_table, "inclusions_per_n_mm3", (2, *of_face)),
        (aside_changes, "aside_in_slabs", (1 + slab_changes.SLABS_A_PLACE, 2, *of_face)),
    ):
        unsolved(monkeypatch, module, name, shape)
    once(monkeypatch, off_axis_table, "tilt_per_degree")
    monkeypatch.setattr(surface_table, "bare_per_n", partial(bare_per_n, levels=QUICK))
    few = {"waveguide": STIFFER.waveguide, "slab_places": 2, "jobs": 1}
    surface_table.write_surface_table(surface_table.build_surface_table(points=(2, 2, 2), **few), tmp_path, STIFFER)
    aside = off_axis_table.build_off_axis_table(points=(2, 2, 2, 2), **few)
    off_axis_table.write_off_axis_table(aside, tmp_path, STIFFER)
    return tmp_path


@pytest.mark.long
def test_another_probes_tables_differ_and_are_refused_beside_the_default_ones_light(built):
    found, own = load_surface_table(built), bare_per_n(scene_in(NOMINAL), FORCES_N, QUICK)
    inside = found.r_mm < 9.9
    w_mm, p_kpa = (found.bare_per_n - own)[:, -1, inside]
    assert np.abs(w_mm).max() > 0.05 * np.abs(own[0, -1, inside]).max()  # a fifth of the layers' share
    assert np.abs(p_kpa).max() > 0.005 * np.abs(own[1, -1, inside]).max()
    tilt_mm, own_mm = (load_off_axis_table(folder).tilt_per_deg[0, 0, 0] for folder in (built, SIMULATED_PROBE))
    assert np.abs(tilt_mm - own_mm).max() > 0.05 * np.abs(own_mm).max()
    for part in ("json", "npz"):
        shutil.copy(SIMULATED_PROBE / f"light_table.{part}", built)
    with pytest.raises(InvalidQuantity, match=r"light table's probe is efd4d351ec5f, but must be .* as the surface"):
        ProbeTables.load(built)
    write_light_table(built, rays=20_000, probe=STIFFER)
    assert ProbeTables.load(built).centred.r_mm[-1] == 11.0
    assert {probe_of_table(built, name) for name in NAMES} == {STIFFER.sha256}
    assert table_record(built, "surface_table")["scene_defaults"]["waveguide"]["layer_moduli_kpa"] == [75.0, 50.0, 25.0]


def test_tables_that_do_not_say_their_probe_are_the_simulated_ones(tmp_path):
    for name in NAMES:
        silent = {key: value for key, value in table_record(SIMULATED_PROBE, name).items() if key != "probe"}
        (tmp_path / f"{name}.json").write_text(json.dumps(silent))
    for folder in (SIMULATED_PROBE, tmp_path):
        assert {probe_of_table(folder, name) for name in NAMES} == {SIMULATED_PROBE_SHA256}


def test_a_table_of_the_simulated_probe_that_says_so_fits_those_that_do_not(tmp_path):
    shutil.copytree(SIMULATED_PROBE, tmp_path, dirs_exist_ok=True)
    surface_table.write_surface_table(load_surface_table(SIMULATED_PROBE), tmp_path)
    assert table_record(tmp_path, "surface_table")["probe"] == {"serial": "SIM-0001", "sha256": OWN.sha256}
    assert ProbeTables.load(tmp_path).centred.r_mm[-1] == 11.0


@pytest.mark.parametrize(
    ("face", "words"),
    [
        (replace(OWN.face, shape="square"), "face.shape of the tables' probe is square, but must be round"),
        (replace(OWN.face, dome_mm=0.5), "face.dome_mm of the tables' probe is 0.5, but must be 0 mm"),
    ],
)
def test_a_face_that_no_table_holds_is_refused_before_anything_is_solved(face, words):
    waveguide = replace(OWN, face=face).waveguide
    for build in (surface_table.build_surface_table, off_axis_table.build_off_axis_table):
        with pytest.raises(InvalidQuantity, match=words):
            build(waveguide=waveguide)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["table"], "out is not given, but must be given with --probe"),
        (["table", "--part", "wide", "--out", "t"], "part is wide, but must be of the simulated probe"),
        (["table", "--out", "t", "--probe", "missing.toml"], "missing.toml, but must be readable"),
    ],
)
def test_what_no_table_is_built_of_is_one_sentence(arguments, words, tmp_path):
    path = tmp_path / "probe.toml"
    path.write_text(probe_text(STIFFER))
    done = run_toolkit(*arguments, *([] if "--probe" in arguments else ["--probe", path]), cwd=tmp_path)
    assert done.returncode == 1
    assert words in done.stderr
    assert list(tmp_path.iterdir()) == [path]


@pytest.fixture
def own(tmp_path):
    """A folder of tables that say they are the stiffer probe's, cheap: with the simulated one's fields."""
    of_worlds = shutil.ignore_patterns("layer_table.*", "face_motion.*", "tissue_layers.*")
    shutil.copytree(SIMULATED_PROBE, tmp_path / "own", ignore=of_worlds)
    surface_table.write_surface_table(load_surface_table(SIMULATED_PROBE), tmp_path / "own", STIFFER)
    for_aside = load_off_axis_table(SIMULATED_PROBE)
    off_axis_table.write_off_axis_table(for_aside, tmp_path / "own", STIFFER)
    write_light_table(tmp_path / "own", rays=20_000, probe=STIFFER)
    return tmp_path / "own"


def test_no_recording_is_said_to_be_the_simulated_probes_that_is_of_other_tables(own, tmp_path):
    arguments = ("phantom", "--table", own, "--set", "random", "--scenes", 1, "--out", tmp_path / "made")
    refused = run_toolkit(*arguments)
    assert refused.returncode == 1
    assert f"surface table's probe is {STIFFER.sha256[:12]}, but must be efd4d351ec5f of SIM-0001" in refused.stderr
    (tmp_path / "probe.toml").write_text(probe_text(STIFFER))
    assert run_toolkit(*arguments, "--probe", tmp_path / "probe.toml").returncode == 0
    assert read_recording(tmp_path / "made" / "random001").serial == "TSIS-0007"


def test_no_bundle_is_trained_on_another_probes_tables(own, tmp_path):
    done = run_toolkit("train", "--mode", "quick", "--table", own, "--out", tmp_path / "model")
    assert done.returncode == 1
    assert "tables' probe is" in done.stderr
    assert "the simulated probe" in done.stderr
    assert not (tmp_path / "model").exists()
