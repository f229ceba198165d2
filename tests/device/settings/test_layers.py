"""Later files over earlier ones, each value with its file; all that is wrong in all of them is told at once."""

from pathlib import Path

import hypothesis.strategies as st
import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings

from device.config import CameraSection, Config, LightSection, conflict
from device.errors import ConfigError
from device.files.plain_settings import DROP_INS, LOCAL, VENDOR, layer_files
from device.measurement.quantities import Bound, InvalidQuantity
from device.settings.catalogue import SETTINGS
from device.settings.layers import overridden, read_layers

SCALARS = st.one_of(st.integers(-10, 10**6), st.floats(), st.booleans(), st.text(max_size=5), st.just("paper"))
VALUES = st.one_of(SCALARS, st.lists(SCALARS, max_size=5), st.dictionaries(st.sampled_from(["bus", "x"]), SCALARS))
KEYS = st.sampled_from(["", *SETTINGS, *{known.section for known in SETTINGS.values()}, "presss.target_n"])


@pytest.fixture
def write(tmp_path):
    def write_text(name, text):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    return write_text


def problems_of(*files):
    return [(problem.file, problem.what.quantity) for problem in read_layers(files).problems]


def test_without_any_file_the_defaults_hold(tmp_path):
    assert layer_files(tmp_path) == []
    assert read_layers([]).config() == Config()


def test_files_lie_over_each_other_in_the_documented_order(write, tmp_path):
    stated = write("mine.toml", "")
    names = [VENDOR, LOCAL, f"{DROP_INS}/10-a.toml", f"{DROP_INS}/9-b.toml", f"{DROP_INS}/b.toml"]
    files = [write(name, "") for name in reversed(names)]
    assert layer_files(tmp_path, stated) == [*reversed(files), stated]


def test_what_an_editor_leaves_beside_a_drop_in_is_not_read(write, tmp_path):
    for name in (".#a.toml", "a.toml~", "a.toml.bak", ".a.toml.swp"):
        write(f"{DROP_INS}/{name}", "[")
    assert layer_files(tmp_path) == []


def test_each_setting_comes_from_the_last_file_that_sets_it(write):
    low = write("low.toml", 'serial = "TSIS-0001"\n[press]\ntarget_n = 0.6\nsteady_n = 0.01\n')
    high = write("high.toml", "[press]\ntarget_n = 0.8\n[light]\nratio = [0.1, 0.2, 0.3, 0.4]\n")
    layers = read_layers([low, high])
    config = layers.config()
    assert (config.serial, config.press.target_n, config.press.steady_n) == ("TSIS-0001", 0.8, 0.01)
    assert config.light.ratio == (0.1, 0.2, 0.3, 0.4)
    assert layers.origins == {
        "serial": low, "press.target_n": high, "press.steady_n": low, "light.ratio": high,
    }  # fmt: skip


def test_every_problem_of_every_file_is_told_at_once_with_its_file(write):
    first = write("a.toml", 'sreial = "x"\n[press]\ntarget_n = 99\nband_ratio = "wide"\n[camera]\ngain = 0.5\n')
    second = write("b.toml", "[light\n")
    third = write("c.toml", "[light]\nratio = [0.5, true, 2.0, 0.5]\n[cell]\nbaud = 9600.5\n")
    assert problems_of(first, second, third) == [
        (first, "sreial"),
        (first, "camera.gain"),
        (first, "press.target_n"),
        (first, "press.band_ratio"),
        (second, "file"),
        (third, "light.ratio[1]"),
        (third, "light.ratio[2]"),
        (third, "cell.baud"),
    ]


def test_the_refusal_says_file_setting_value_bound_and_hint_in_a_line_for_each_problem(write):
    path = write("a.toml", "[press]\ntarget_n = 99\n[camera]\ngian = 2\n")
    with pytest.raises(ConfigError) as refusal:
        read_layers([path]).config()
    unknown, out_of_range = refusal.value.cause.splitlines()
    assert unknown.startswith(f"{path}: camera.gian is 2, but must be one of ")
    assert unknown.endswith("did you mean camera.gain.")
    assert out_of_range == (f"{path}: press.target_n is 99, but must be at least 0.1 and at most 20 N: correct it.")
    assert refusal.value.code == "E001"


def test_a_bad_value_is_a_problem_also_where_a_later_file_overrides_it(write):
    low, high = write("low.toml", "[press]\ntarget_n = 99\n"), write("high.toml", "[press]\ntarget_n = 0.5\n")
    assert problems_of(low, high) == [(low, "press.target_n")]


def test_what_does_not_fit_together_is_told_for_every_section(write):
    low = write("low.toml", "[press]\ntarget_n = 2.0\n[camera]\nexposure_us = 20000\n")
    high = write("high.toml", "[camera]\nframe_rate_hz = 100\n")
    assert problems_of(low, high) == [(low, "camera.exposure_us"), (low, "press.overload_n")]


@pytest.fixture
def between_sections(monkeypatch):
    """As if a frame had to be lit by as many milliseconds as the bus has for its number."""

    def conflicts(config):
        bound = Bound(1, 1000 * config.light.bus, "us, the light's")
        return conflict("camera.exposure_us", config.camera.exposure_us, bound, "light.bus")

    monkeypatch.setattr(Config, "conflicts", conflicts)


def test_sections_are_compared_as_all_files_together_leave_them(write, between_sections):
    low = write("low.toml", "[light]\nbus = 2\n")
    high = write("high.toml", "[camera]\nexposure_us = 2000\n")
    assert read_layers([low, high]).config().camera.exposure_us == 2000
    assert problems_of(low) == [(low, "camera.exposure_us")]


def test_a_section_that_does_not_hold_is_not_compared_with_others(write, between_sections):
    path = write("a.toml", "[light]\nbus = 2\n[camera]\nexposure_us = 20000\nframe_rate_hz = 100\n")
    [problem] = read_layers([path]).problems
    assert problem.what.bound.endswith("one frame")


def test_sections_that_hold_are_compared_also_when_another_does_not(write):
    """Light and camera do not fit together here, whatever is wrong with the press."""
    path = write("a.toml", '[light]\nchip = "pca9685"\npwm_hz = 24\n[press]\ntarget_n = 2.0\n')
    assert problems_of(path) == [(path, "press.overload_n"), (path, "light.pwm_hz")]


def test_a_default_that_no_longer_fits_is_told_at_the_file_that_changed_the_other_setting(write):
    [problem] = read_layers([write("a.toml", "[press]\ntarget_n = 2.0\n")]).problems
    assert str(problem).endswith(
        "press.overload_n is 1.0, but must be at least 2.4 and at most 50 N, a fifth above the target: "
        "correct it or press.target_n."
    )


def test_a_setting_that_is_refused_is_not_compared_with_others(write):
    path = write("a.toml", "[press]\ntarget_n = 2.0\noverload_n = 99\n[camera]\ngain = 1.0\n")
    assert problems_of(path) == [(path, "press.overload_n")]


def test_a_name_with_a_full_stop_in_it_is_no_way_into_a_section(write):
    path = write("a.toml", '"press.target_n" = 99\n')
    assert problems_of(path) == [(path, "press.target_n")]


def test_the_stated_file_has_to_be_there(tmp_path):
    none = tmp_path / "none.toml"
    assert problems_of(*layer_files(tmp_path, none)) == [(none, "file")]


def test_a_link_to_nothing_is_a_problem_and_no_missing_file(tmp_path):
    link = tmp_path / LOCAL
    link.parent.mkdir(parents=True)
    link.symlink_to(tmp_path / "gone.toml")
    assert problems_of(*layer_files(tmp_path)) == [(link, "file")]


def test_a_folder_that_may_not_be_read_is_a_problem_and_no_missing_file(tmp_path, monkeypatch):
    def refuse(path):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "lstat", refuse)
    monkeypatch.setattr(Path, "iterdir", refuse)
    assert layer_files(tmp_path) == [tmp_path / VENDOR, tmp_path / LOCAL, tmp_path / DROP_INS]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(entries=st.dictionaries(KEYS, VALUES, max_size=4))
def test_any_file_is_settings_that_hold_or_a_refusal_that_names_it(write, entries):
    table = {}
    for name, value in entries.items():
        section, _, key = name.rpartition(".")
        table[section or key] = {key: value} if section else value
    path = write("any.toml", tomli_w.dumps(table))
    layers = read_layers([path])
    if layers.problems:
        assert {problem.file for problem in layers.problems} == {path}
    else:
        assert set(table) <= set(vars(layers.config()))


OWN = Config(serial="TSIS-0007", camera=CameraSection(frame_rate_hz=100.0), light=LightSection(max_on_s=60.0))


def test_what_a_scene_states_replaces_its_own_setting_and_nothing_else():
    table = {"calibration": "somewhere", "light": {"ratio": [0.1, 0.2, 0.3, 0.4]}}
    config = overridden(OWN, table)
    assert config.calibration == Path("somewhere")
    assert config.light == LightSection(max_on_s=60.0, ratio=(0.1, 0.2, 0.3, 0.4))
    assert (config.serial, config.camera) == ("TSIS-0007", OWN.camera)
    assert overridden(OWN, {}) == OWN


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"light": {"max_on": 1.0}}, "light.max_on is 1.0.*did you mean light.max_on_s"),
        ({"light": 1.0}, "light is 1.0, but must be a table"),
        ({"light": {"max_on_s": "long"}}, "light.max_on_s is 'long', but must be a valid number"),
        ({"light": {"max_on_s": 0.0}}, "light.max_on_s is 0.0, but must be at least 1 "),
        ({"camera": {"exposure_us": 20_000}}, "camera.exposure_us is 20000.*10000"),
        ({"lihgt": {"max_on_s": 1.0}}, "did you mean light"),
    ],
)
def test_a_scenes_setting_that_is_unknown_mistyped_out_of_range_or_does_not_fit_is_refused_by_its_name(table, words):
    with pytest.raises(InvalidQuantity, match=words):
        overridden(OWN, table)
