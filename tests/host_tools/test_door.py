"""`import host_tools` is one door: every name is there, documented, loaded when asked for, and lasts."""

import ast
import subprocess
import sys
from inspect import getdoc

import numpy as np
import pytest
import xarray as xr
from daemon_process import ROOT

import device.measurement
import host_tools as tsis

DOORS = (tsis, device.measurement)
ALIASES = (device.measurement.Array, device.measurement.Single, device.measurement.Mode)
"""Types that have no place for a docstring of their own."""
SCENE = tsis.Scene(tsis.Inclusion(10.0, 6.0, 80.0), tsis.Press(force_n=0.5))


@pytest.fixture(scope="module")
def solution():
    return tsis.solve(SCENE, tolerance=0.01, strain="small")


def typed(door):
    """What a type checker sees: the module of each name imported under `TYPE_CHECKING`."""
    tree = ast.parse((ROOT / door.__name__.replace(".", "/") / "__init__.py").read_text(encoding="utf-8"))
    imports = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module.count("."))
    return {alias.name: node.module for node in imports for alias in node.names}


@pytest.mark.parametrize("door", DOORS, ids=lambda door: door.__name__)
def test_every_name_of_a_door_resolves_and_is_documented(door):
    assert door.__all__ == sorted(door.__all__)
    assert typed(door) == door._HOME
    assert set(door.__all__) == set(door._HOME)
    for name in door.__all__:
        assert f"`{name}`" in door.__doc__ or f" {name}" in door.__doc__
        value = getattr(door, name)
        assert getdoc(value) or value in ALIASES, name


@pytest.mark.parametrize("door", DOORS, ids=lambda door: door.__name__)
def test_a_door_lists_its_names_and_no_others(door):
    assert dir(door) == door.__all__
    with pytest.raises(AttributeError, match="has no attribute 'scenery'"):
        _ = door.scenery


@pytest.mark.parametrize("door", DOORS, ids=lambda door: door.__name__)
def test_no_name_of_a_door_is_a_room_or_a_module(door):
    """A room of the same name would take the name's place as soon as anyone imports it."""
    folder = ROOT / door.__name__.replace(".", "/")
    assert not set(door.__all__) & {path.stem for path in folder.iterdir()}


@pytest.mark.parametrize("door", DOORS, ids=lambda door: door.__name__)
def test_a_door_opens_without_loading_anything(door):
    code = f"import sys, {door.__name__}; print([m for m in ('numpy', 'ngsolve', 'cv2', 'xarray') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_tolerance_is_a_ratio():
    with pytest.raises(tsis.InvalidQuantity, match="tolerance is 2, but must be above 0 and at most 1: give a ratio"):
        tsis.solve(SCENE, tolerance=2)


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"strain": "Finite"}, "strain is 'Finite', but must be one of small, finite, auto"),
        ({"within_s": -1.0}, "within_s is -1.0"),
        ({"within_s": float("nan")}, "within_s is nan"),
    ],
)
def test_what_is_asked_of_a_solution_is_checked_before_anything_is_solved(asked, told):
    with pytest.raises(tsis.InvalidQuantity, match=told):
        tsis.solve(SCENE, **asked)


def test_so_small_an_inclusion_is_refused_that_its_mesh_would_take_minutes():
    with pytest.raises(tsis.InvalidQuantity, match="size_mm is 1e-06, but must be at least 0.001"):
        tsis.solve(tsis.Scene(tsis.Inclusion(1e-6, 6.0, 80.0)))


@pytest.mark.parametrize(
    "presses",
    [
        [tsis.Press(indentation_mm=0.1), tsis.Press(force_n=0.5)],
        [tsis.Press(force_n=0.5), tsis.Press(indentation_mm=0.1)],
        [tsis.Press(indentation_mm=1.0), tsis.Press(indentation_mm=0.5)],
    ],
)
def test_presses_of_a_ramp_are_of_one_kind_and_rise(presses):
    with pytest.raises(tsis.InvalidQuantity, match="all by indentation or all by force, rising"):
        tsis.solve_ramp(SCENE, presses)


def test_a_tighter_tolerance_takes_a_finer_model_and_says_so():
    rough, tight = (tsis.solve(SCENE, tolerance=t, strain="small") for t in (0.1, 0.001))
    assert "10 %" in rough.plan.reasons["level"]
    assert rough.plan.order < tight.plan.order
    assert rough.inclusion_field.max_deformation_mm == pytest.approx(tight.inclusion_field.max_deformation_mm, rel=0.1)


def test_a_tolerance_that_is_not_held_is_refused_unless_the_best_is_asked_for():
    asked = {"tolerance": 1e-9, "strain": "small", "within_s": 0.5}
    with pytest.raises(tsis.ToleranceMissed, match="only good to"):
        tsis.solve(SCENE, **asked)
    assert tsis.solve(SCENE, **asked, best=True).stated_error["max_deformation_mm"] > 1e-9


def test_without_a_tolerance_the_best_is_returned_with_a_warning():
    with pytest.warns(UserWarning, match="tolerance is 0.5 %, but .* only good to"):
        assert tsis.solve(SCENE, within_s=0.1).stated_error["central_deformation_mm3"] > 0.01


@pytest.mark.long
def test_strain_follows_the_tolerance_unless_it_is_asked_for(solution):
    assert solution.plan.strain == "small"
    assert tsis.solve(SCENE, tolerance=0.5).plan.strain == "small"  # at 0.5 N it is said to depart by more than 0.2
    assert tsis.solve(SCENE, tolerance=0.05).plan.strain == "finite"


def test_a_solution_is_a_data_set_with_units_and_origin(solution):
    dataset = solution.to_xarray()
    assert dict(dataset.sizes) == {"load": 1, "r_mm": 221}
    assert float(dataset.force_n[0]) == pytest.approx(0.5)
    np.testing.assert_array_equal(dataset.inclusion_deformation_mm[0], solution.inclusion_deformation_mm)
    np.testing.assert_array_equal(dataset.contact_pressure_kpa[0], solution.p_kpa)
    assert {dataset[name].attrs["units"] for name in ("deformation_mm", "r_mm")} == {"mm"}
    assert dataset.contact_pressure_kpa.attrs["units"] == "kPa"
    assert dataset.stated_error_max_deformation_mm.attrs["units"] == "1"
    assert '"size_mm": 10.0' in dataset.attrs["scene"]
    assert '"symmetry": "axisymmetric"' in dataset.attrs["plan"]
    assert all(variable.attrs["units"] for variable in dataset.variables.values())


def test_a_data_set_survives_its_file(solution, tmp_path):
    dataset = solution.to_xarray()
    dataset.to_netcdf(tmp_path / "solution.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "solution.nc", engine="h5netcdf") as read:
        xr.testing.assert_identical(read.load(), dataset)


def test_a_ramp_is_one_data_set_with_a_row_a_load():
    ramp = tsis.solve_ramp(SCENE, [tsis.Press(indentation_mm=d) for d in (0.5, 1.0)], strain="small")
    dataset = tsis.dataset_of(ramp)
    assert dataset.indentation_mm.values.tolist() == [0.5, 1.0]
    ratio = dataset.deformation_mm[1] / dataset.deformation_mm[0]
    np.testing.assert_allclose(ratio, 2.0, rtol=1e-9)  # small strain is linear


def test_a_solution_off_the_axis_has_an_angle(off_axis):
    dataset = off_axis.to_xarray()
    assert dict(dataset.sizes) == {"load": 1, "angle_deg": 48, "r_mm": 221}
    brightest = dataset.inclusion_deformation_mm[0].where(dataset.r_mm < 9.9).argmax(...)
    assert float(dataset.angle_deg[brightest["angle_deg"]]) == pytest.approx(0.0)
    assert 3.0 < float(dataset.r_mm[brightest["r_mm"]]) < 8.0


@pytest.fixture(scope="module")
def off_axis():
    scene = tsis.Scene(SCENE.inclusion, SCENE.press, placement=tsis.Placement(offset_x_mm=6.0))
    return tsis.solve(scene, tolerance=0.2, strain="small")


def test_a_solution_plots_itself_through_the_whole_face_or_over_its_radius(solution, off_axis):
    from matplotlib import pyplot as plt

    over_radius, through = solution.plot(), off_axis.plot()
    assert [panel.get_xlabel() for panel in over_radius.axes] == ["radius (mm)"] * 3
    x_mm, added_um = through.axes[1].lines[0].get_data()
    assert (x_mm[0], x_mm[-1]) == pytest.approx((-11.0, 11.0))
    assert (np.diff(x_mm) > 0).all()
    assert 3.0 < x_mm[np.argmax(np.where(np.abs(x_mm) < 9.9, added_um, 0))] < 8.0
    plt.close(over_radius)
    plt.close(through)


def test_a_solution_says_in_one_line_what_it_is(solution):
    assert repr(solution).startswith("<Solution: 0.5 N at 2.4")
    assert repr(solution).endswith("axisymmetric, small strain, 576 elements>")


def test_a_notebook_shows_numbers_with_errors_reasons_and_a_picture(solution):
    page = solution._repr_html_()
    assert "<td>max_deformation_mm</td>" in page
    assert "<td>strain</td><td>small</td><td>asked for</td>" in page
    assert "data:image/png;base64,iVBOR" in page
    assert f"{100 * solution.stated_error['force_n']:.2g} %" in page
    assert len(page) < 100_000


def test_a_sweep_is_a_data_set_in_the_names_of_a_solution(tmp_path, solution):
    swept = tsis.sweep(2, tmp_path / "two.nc", seed=3, jobs=1)
    assert dict(swept.sizes) == {"scene": 2, "r_mm": 221}
    assert {"inclusion_deformation_mm", "contact_pressure_kpa"} <= set(swept) & set(solution.to_xarray())
    assert swept.inclusion_deformation_mm.attrs["units"] == "mm"
    inside = swept.r_mm < 9.9
    peak = swept.inclusion_deformation_mm.where(inside).max("r_mm")
    np.testing.assert_allclose(peak, swept.max_deformation_mm, rtol=1e-3)
    xr.testing.assert_identical(tsis.read_sweep(tmp_path / "two.nc"), swept)


def test_limits_are_those_of_the_command():
    found = tsis.limits(SCENE, tsis.PressProtocol(forces_n=(0.2, 0.4), strain="small"))
    assert found.std.shape == (3,)
    assert found.identifiable == tuple(found.std_with_box < 0.5 * found.box_std)


def test_a_recording_is_analysed_as_the_probe_would(recording, calibration, bundle):
    by_default = tsis.analyse(recording)
    assert by_default == tsis.analyse(recording, mode="paper")
    assert by_default == tsis.ModeModels(bundle).estimate(recording, "paper", calibration)
    assert by_default.size_mm.low < 12.0 < by_default.size_mm.high


def test_a_recording_is_read_from_its_folder(recording, tmp_path):
    tsis.write_recording(recording, tmp_path / "press")
    assert tsis.analyse(tmp_path / "press") == tsis.analyse(tsis.read_recording(tmp_path / "press"))
