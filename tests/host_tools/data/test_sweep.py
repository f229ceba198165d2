"""A sweep can be stopped anywhere and goes on where it was; a scene that fails is a row with its reason."""

import json
import os
import re
import signal
import subprocess
import sys
from contextlib import nullcontext, suppress
from dataclasses import replace

import numpy as np
import pytest
from daemon_process import ROOT, WAIT_S, wait_for
from sweep_rows import SCENES, synthetic_row, synthetic_rows
from typer.testing import CliRunner

from device.measurement.quantities import InvalidQuantity
from host_tools.__main__ import app
from host_tools.data import rows as rows_module
from host_tools.data import sweep as sweep_module
from host_tools.data.dataset import phantom_index, read_dataset, training_rows
from host_tools.data.plan import SweepPlan
from host_tools.data.rows import solve_row
from host_tools.data.sweep import sweep
from host_tools.scenes.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW


def _start(folder, name, jobs):
    command = [sys.executable, "-m", "host_tools", "sweep", "--scenes", str(SCENES), "--seed", "4", "--out", name]
    command += ["--jobs", str(jobs)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        command,
        cwd=folder,
        env=environment,
        stderr=subprocess.PIPE,
        start_new_session=True,
        preexec_fn=_hear_interrupts,
    )


def _hear_interrupts():
    """A shell's background job ignores SIGINT, and so would all that it starts."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _wait_for_rows(journal, count):
    wait_for(lambda: journal.exists() and journal.read_bytes().count(b"\n"), lambda rows: rows > count)


@pytest.mark.parametrize(
    ("jobs", "stop"), [(1, signal.SIGKILL), pytest.param(2, signal.SIGINT, marks=pytest.mark.long)]
)
def test_an_interrupted_sweep_goes_on_and_gives_the_same_data(tmp_path, uninterrupted, stop, jobs):
    journal, out = tmp_path / "s.nc.partial", tmp_path / "s.nc"
    running = _start(tmp_path, "s.nc", jobs)
    _wait_for_rows(journal, 1)  # a header and a row
    os.killpg(running.pid, stop)
    _, told = running.communicate(timeout=WAIT_S)
    assert running.returncode == (130 if stop == signal.SIGINT else -signal.SIGKILL)
    assert not out.exists()
    if stop == signal.SIGINT:
        assert b"run the same command to go on" in b" ".join(told.split())
    done = journal.read_bytes().count(b"\n") - 1
    assert 0 < done < SCENES
    journal.write_bytes(journal.read_bytes() + b'{"index": 4, "torn by a cra')
    again = _start(tmp_path, "s.nc", jobs)
    again.communicate(timeout=WAIT_S)
    assert again.returncode == 0
    assert not journal.exists()
    # Workers may differ from this process in the last bits of their linear algebra.
    for name, values in read_dataset(out).items():
        if name != "reason":
            np.testing.assert_allclose(values, uninterrupted[name], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("swallow", ["ignored", "called_a_failure"])
def test_an_interrupt_that_a_solver_swallows_stops_the_sweep_and_no_scene_has_failed_by_it(
    tmp_path, monkeypatch, swallow
):
    """NGSolve's callbacks hand exceptions over as errors of their own, and a destructor drops them."""
    plan, out = SweepPlan(3, 4), tmp_path / "s.nc"

    def solve(plan, index, truth):
        if index == 1:
            with suppress(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
        reason = "RuntimeError" if swallow == "called_a_failure" and index == 1 else ""
        return synthetic_row(index, truth) | {"reason": reason}

    monkeypatch.setattr(sweep_module, "solve_row", solve)
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        sweep(plan, out, jobs=1)
    assert signal.getsignal(signal.SIGINT) is before
    assert not out.exists()
    kept = (tmp_path / "s.nc.partial").read_text(encoding="utf-8")
    assert '"index": 0' in kept
    assert '"index": 1' not in kept


def test_a_failed_scene_is_kept_with_its_reason_and_left_out_of_training(tmp_path, monkeypatch):
    solve = rows_module.solve_ramp
    monkeypatch.setattr(
        rows_module,
        "solve_ramp",
        lambda scene, *given, **named: solve(scene, *given, **named) if scene.inclusion.size_mm > 8 else 1 / 0,
    )
    plan = SweepPlan(6, 4)
    path = sweep(plan, tmp_path / "s.nc", jobs=1)
    small = plan.truths()[:, 0] <= 8
    dataset, rows = read_dataset(path), training_rows(path)
    assert 0 < small.sum() < 6
    assert ["ZeroDivisionError" in reason for reason in dataset["reason"].values] == small.tolist()
    assert np.isnan(dataset["max_deformation_mm"].values[small]).all()
    assert rows.excluded_rows == small.sum()
    assert np.isfinite(rows.features).all()


def test_a_scene_that_cannot_be_solved_is_a_row_not_a_crash():
    row = solve_row(SweepPlan(1, 1), 0, np.array([10.0, 25.0, 80.0]))
    assert "depth_mm + size_mm" in row["reason"]


def test_scenes_fill_the_papers_box_and_a_longer_sweep_begins_like_a_shorter():
    truths = SweepPlan(2000, 7).truths()
    filled = np.ptp(truths, axis=0) / np.subtract(PAPER_BOX_HIGH, PAPER_BOX_LOW)
    assert (truths >= PAPER_BOX_LOW).all()
    assert (truths <= PAPER_BOX_HIGH).all()
    assert (filled > 0.99).all()
    np.testing.assert_array_equal(truths[:10], SweepPlan(10, 7).truths())


def test_the_rows_know_the_press_and_the_units(uninterrupted):
    assert uninterrupted["force_n"].values == pytest.approx(0.5)
    assert uninterrupted["w_mm"].dims == ("scene", "r_mm")
    assert uninterrupted["deformation_area_mm2"].attrs["units"] == "mm2"


def test_several_loads_are_an_axis_and_scale_in_small_strain(tmp_path):
    dataset = read_dataset(sweep(SweepPlan(2, 4, (0.1, 0.2, 0.5)), tmp_path / "s.nc", jobs=1))
    assert dataset["w_mm"].dims == ("scene", "load", "r_mm")
    assert dataset["max_deformation_mm"].dims == ("scene", "load")
    assert dataset["depth_mm"].dims == ("scene",)
    np.testing.assert_allclose(dataset["force_n"].values, [[0.1, 0.2, 0.5]] * 2)
    np.testing.assert_allclose(dataset["w_mm"].sel(load=0.2), 2 * dataset["w_mm"].sel(load=0.1), rtol=1e-9)


def test_one_of_several_loads_equals_a_sweep_of_it_alone(tmp_path, uninterrupted):
    dataset = read_dataset(sweep(SweepPlan(2, 4, (0.1, 0.5)), tmp_path / "s.nc", jobs=1))
    np.testing.assert_allclose(dataset["p_kpa"].sel(load=0.5), uninterrupted["p_kpa"][:2], rtol=1e-9)


def test_several_loads_do_not_train(tmp_path, monkeypatch):
    def of_two_loads(solve, cases):
        for row in synthetic_rows(solve, cases):
            yield row | {name: [row[name]] * 2 for name in ("w_mm", "w_baseline_mm", "p_kpa")}

    monkeypatch.setattr(sweep_module, "executor", lambda **_: nullcontext(of_two_loads))
    path = sweep(SweepPlan(3, 1, (0.1, 0.5)), tmp_path / "s.nc")
    with pytest.raises(InvalidQuantity, match="one load in small strain"):
        training_rows(path)


def test_a_row_that_comes_twice_is_written_once(tmp_path, monkeypatch):
    def doubled(solve, cases):
        for row in synthetic_rows(solve, cases):
            yield from (row, row | {"w_mm": [0.0] * 221})

    monkeypatch.setattr(sweep_module, "executor", lambda **_: nullcontext(doubled))
    heard = []
    path = sweep(SweepPlan(4, 1), tmp_path / "s.nc", on_row=lambda row, done: heard.append((row["index"], done)))
    assert heard == [(0, 1), (1, 2), (2, 3), (3, 4)]
    assert read_dataset(path)["w_mm"].values[:, 0].tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("given", "quantity"),
    [
        ({"forces_n": ()}, "forces_n"),
        ({"forces_n": (0.3, 0.1)}, "forces_n"),
        ({"forces_n": (0.1, 0.1)}, "forces_n"),
        ({"forces_n": (0.0,)}, "force_n"),
        ({"strain": "large"}, "strain"),
        ({"strain": "auto"}, "strain"),
    ],
)
def test_loads_that_are_no_ramp_are_refused(given, quantity):
    with pytest.raises(InvalidQuantity) as refused:
        SweepPlan(5, 1, **given)
    assert refused.value.quantity == quantity


def test_the_command_hands_over_loads_and_scheduler(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(sweep_module, "sweep", lambda plan, out, **options: asked.append((plan, options["scheduler"])))
    command = ["sweep", "--out", str(tmp_path / "s.nc"), "--scenes", "3"]
    ramp = ["--force-n", "0.1", "--force-n", "0.3", "--strain", "finite", "--scheduler", "tcp://there:8786"]
    assert CliRunner().invoke(app, command).exit_code == 0
    assert CliRunner().invoke(app, command + ramp).exit_code == 0
    assert asked == [(SweepPlan(3, 1), None), (SweepPlan(3, 1, (0.1, 0.3), "finite"), "tcp://there:8786")]


def test_nine_different_rows_are_the_phantoms():
    chosen = phantom_index(SweepPlan(134, 1).truths())
    assert len(set(chosen)) == 9


@pytest.mark.parametrize("content", [b"", b"not netCDF"])
def test_a_file_that_is_no_sweep_is_refused(tmp_path, content):
    (tmp_path / "x.nc").write_bytes(content)
    with pytest.raises(InvalidQuantity, match="host_tools sweep"):
        read_dataset(tmp_path / "x.nc")


@pytest.fixture
def held(tmp_path, monkeypatch):
    """A finished sweep of few scenes, and how often rows were asked for since."""
    asked = []

    def rows_of(solve, cases):
        asked.append(1)
        return synthetic_rows(solve, cases)

    monkeypatch.setattr(sweep_module, "executor", lambda **where: nullcontext(rows_of))
    out = sweep(SweepPlan(SCENES, 4), tmp_path / "s.nc")
    asked.clear()
    return out, asked


def test_a_sweep_that_is_done_is_not_solved_again(held):
    out, asked = held
    before = out.read_bytes()
    assert sweep(SweepPlan(SCENES, 4), out) == out
    assert (asked, out.read_bytes()) == ([], before)


def test_another_sweep_never_replaces_a_file_unless_told_to(held):
    out, asked = held
    before = out.read_bytes()
    with pytest.raises(InvalidQuantity, match=r"which holds something else.*--force"):
        sweep(SweepPlan(SCENES, 5), out)
    assert (asked, out.read_bytes()) == ([], before)
    sweep(SweepPlan(SCENES, 5), out, replace=True)
    assert json.loads(read_dataset(out).attrs["origin"])["seed"] == 5


def test_a_file_that_is_no_sweep_is_not_replaced(tmp_path):
    out = tmp_path / "notes.txt"
    out.write_text("mine")
    with pytest.raises(InvalidQuantity, match="which holds something else"):
        sweep(SweepPlan(SCENES, 4), out, jobs=1)
    assert out.read_text() == "mine"


def test_a_file_that_cannot_be_written_leaves_nothing_behind_and_its_rows_are_kept(held, monkeypatch):
    out, _ = held

    def full(*layout):
        raise OSError("No space left on device")

    monkeypatch.setattr("host_tools.data.dataset_file._lay_out", full)
    with pytest.raises(OSError, match="No space"):
        sweep(SweepPlan(SCENES, 6), out.with_name("t.nc"))
    assert sorted(path.name for path in out.parent.iterdir()) == ["s.nc", "t.nc.partial"]


def test_a_scene_climbs_until_it_holds_the_tolerance_or_says_what_is_only_good_to_how_much():
    """0.5 N presses some 2 mm deep, where small strain departs by more."""
    plan = SweepPlan(1, 4, strain="auto", tolerance=0.2)
    row = solve_row(plan, 0, plan.truths()[0])
    assert row["reason"] == ""
    stated = {name: one[0] for name, one in row.items() if name.startswith("stated_error_")}
    del stated["stated_error_total_deformation_mm3"]  # what the centre gains under a force the rim loses
    assert 0 < max(stated.values()) <= 0.2
    assert re.fullmatch(r"finite strain, sliding\w* \d", row["level"])
    tight = replace(plan, strain="small", tolerance=1e-6, within_s=0.1)
    given_up = solve_row(tight, 0, plan.truths()[0])["reason"]
    assert re.match(r"tolerance is 0.0001 %, but \w+ is only good to .*more time \(--within-s\)", given_up)
    assert (plan.as_record()["tolerance"], "tolerance" in SweepPlan(1, 4).as_record()) == (0.2, False)


def test_a_row_of_auto_is_in_the_strain_measure_that_the_tolerance_asks_for():
    light = SweepPlan(1, 4, (0.005,), "auto", tolerance=0.1)
    rows = [solve_row(plan, 0, light.truths()[0]) for plan in (light, replace(light, strain="small"))]
    assert [row["level"].split(",")[0] for row in rows] == ["small strain"] * 2
    # Where it was chosen, it states what it departs by as well.
    assert rows[0]["stated_error_indentation_mm"][0] > 2 * rows[1]["stated_error_indentation_mm"][0]


def test_a_sweep_with_another_tolerance_or_more_time_is_another_sweep_and_none_to_train_from(tmp_path, monkeypatch):
    climbed = SweepPlan(2, 1, tolerance=0.05)
    others = SweepPlan(2, 1), replace(climbed, tolerance=0.1), replace(climbed, within_s=600.0)
    assert len({json.dumps(plan.as_record()) for plan in (climbed, *others)}) == 4

    def solved(plan, index, truth):
        row = synthetic_row(index, truth)
        return row | {name: [row[name]] for name in ("w_mm", "w_baseline_mm", "p_kpa")} | {"level": "small"}

    monkeypatch.setattr(sweep_module, "solve_row", solved)
    path = sweep(climbed, tmp_path / "s.nc", jobs=1)
    assert list(read_dataset(path)["level"].values) == ["small", "small"]
    with pytest.raises(InvalidQuantity, match="without --strain and --tolerance"):
        training_rows(path)
    with pytest.raises(InvalidQuantity, match="add --force"):
        sweep(others[2], path, jobs=1)


@pytest.mark.parametrize(("force_n", "said"), [("0.5", r"by \d+ % in the middle of the box"), ("2", r"by \d\d\d+ %")])
def test_a_sweep_in_small_strain_says_what_that_departs_by(tmp_path, monkeypatch, force_n, said):
    monkeypatch.setattr(sweep_module, "sweep", lambda plan, out, **options: out)
    command = ["sweep", "--out", str(tmp_path / "s.nc"), "--scenes", "1", "--force-n", force_n]
    told = CliRunner().invoke(app, command)
    assert (told.exit_code, bool(re.search(said, told.output.replace("\n", " ")))) == (0, True)


def test_a_sweep_that_succeeded_stays_so_where_small_strain_gives_way_in_the_middle_of_the_box(tmp_path, monkeypatch):
    monkeypatch.setattr(sweep_module, "sweep", lambda plan, out, **options: out)
    told = CliRunner().invoke(app, ["sweep", "--out", str(tmp_path / "s.nc"), "--scenes", "1", "--force-n", "20"])
    assert (told.exit_code, "more than could be found" in told.output) == (0, True)


def test_the_command_asks_for_the_strain_measure_of_the_tolerance_unless_told(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(sweep_module, "sweep", lambda plan, out, **options: asked.append((plan.strain, plan.within_s)))
    command = ["sweep", "--out", str(tmp_path / "s.nc"), "--scenes", "1", "--tolerance", "2%"]
    for more in ([], ["--strain", "small", "--within-s", "7"], ["--strain", "finite"]):
        assert CliRunner().invoke(app, command + more).exit_code == 0
    assert asked == [("auto", 120.0), ("small", 7.0), ("finite", 120.0)]
