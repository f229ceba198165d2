"""What darkens the LEDs finds their chip where the daemon, which checks all settings, has it; or looks everywhere."""

import re
from pathlib import Path

import hypothesis.strategies as st
import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from room import ROOT

from device.config import LightSection
from device.config_chips import CHIP_ADDRESSES, LightWiring
from device.errors import ConfigError
from device.files.plain_settings import DATA, DROP_INS, LAST_GOOD, LOCAL, VENDOR, layer_files
from device.settings.last_good import start_settings
from device.settings.layers import read_layers
from device.settings.plain_light import plain_light

EVERY_CHIP = (LightWiring(chip="tlc59116"), LightWiring(chip="pca9685"))
LAYERS = (VENDOR, LOCAL, f"{DROP_INS}/10.toml", f"{DROP_INS}/20.toml")
NEAR_RANGE = {
    "chip": st.sampled_from(["tlc59116", "pca9685", "pca9686", "", 3, ["pca9685"]]),
    "bus": st.integers(-1, 256) | st.sampled_from([1.0, True, "1"]),
    "address": st.sampled_from([0x40, 0x41, 0x60, 0x6F]) | st.integers(0x07, 0x78) | st.just(10**400),
    "enable_chip": st.text(max_size=3) | st.just(0),
    "enable_line": st.integers(-1, 512),
    "pwm_hz": st.floats(23.0, 1527.0) | st.integers(23, 1527) | st.sampled_from([float("nan"), float("inf")]),
    "oscillator_hz": st.floats(19e6, 31e6) | st.just(25_000_000),
    "ratio": st.just([0.5] * 4) | st.just([2.0]),
    "chp": st.just("pca9685"),
}
STATED = st.fixed_dictionaries(
    {},
    optional={
        "light": st.fixed_dictionaries({}, optional=NEAR_RANGE) | st.just("none"),
        "server": st.fixed_dictionaries({}, optional={"port": st.integers(0, 70_000)}),
    },
)
GOOD = st.fixed_dictionaries(
    {}, optional={"chip": st.sampled_from(list(CHIP_ADDRESSES)), "bus": st.integers(0, 255), "address": st.just(0x6A)}
)


def say(root: Path, name: str, text: str) -> None:
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


@pytest.fixture
def fresh(tmp_path_factory):
    return lambda: tmp_path_factory.mktemp("root")


def test_without_a_file_the_chip_is_where_it_is_by_default(tmp_path: Path):
    said = plain_light(layer_files(tmp_path))
    assert (said.wirings, said.is_said, said.data) == ((LightSection().wiring,), True, Path(DATA))


def _examples() -> list[str]:
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    return [text for page in pages for text in re.findall(r"^ *```toml\n(.*?)^ *```", page.read_text(), re.M | re.S)]


def test_every_example_of_the_pages_says_the_same_place_as_to_the_daemon(tmp_path: Path):
    compared = []
    for text in _examples():
        say(tmp_path, LOCAL, text)
        layers = read_layers(layer_files(tmp_path))
        if not layers.problems:  # an example of a settings file
            said = plain_light(layer_files(tmp_path))
            assert said.is_said
            assert said.wirings == (layers.config().light.wiring,)
            compared.append(text)
    assert any("[light]" in text for text in compared)


@settings(deadline=None, max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(stated=st.lists(STATED, max_size=4), last=GOOD | st.none())
def test_the_place_that_the_daemon_starts_with_is_always_darkened(fresh, stated, last):
    root = fresh()
    say(root, VENDOR, tomli_w.dumps({"data": str(root)}))
    for name, table in zip(LAYERS[1:], stated, strict=False):
        say(root, name, tomli_w.dumps(table))
    if last is not None:
        say(root, LAST_GOOD, tomli_w.dumps({"light": last}))
    files = layer_files(root)
    said, layers = plain_light(files), read_layers(files)
    assert said.wirings
    assert said.data == root
    if not layers.problems:
        assert said.is_said
        assert said.wirings[0] == layers.config().light.wiring
    elif not any(problem.what.quantity.startswith("light") for problem in layers.problems):
        assert said.is_said, "what is bad elsewhere does not hide where the chip is"
    try:
        started = start_settings(layers).config.light.wiring
    except ConfigError:
        return
    assert started in said.wirings


@pytest.mark.parametrize(
    "bad",
    ["no = [toml", "\x00", "light = 3\n", "x = " + "[" * 100_000, '[light]\nchip = "pca9686"\n',
     "[light]\naddress = 0x68\n", "[light]\nbus = 256\n"],
)  # fmt: skip
def test_with_a_bad_file_the_last_good_settings_say_it_and_without_them_every_chip_may_be_it(tmp_path: Path, bad: str):
    say(tmp_path, VENDOR, f'data = "{tmp_path}"\n')
    say(tmp_path, LOCAL, bad)
    said = plain_light(layer_files(tmp_path))
    assert not said.is_said
    assert {wiring.chip for wiring in said.wirings} == set(CHIP_ADDRESSES)
    say(tmp_path, LAST_GOOD, "[light]\nbus = 3\n")
    assert plain_light(layer_files(tmp_path)).wirings == (LightWiring(bus=3),)
    say(tmp_path, LAST_GOOD, bad)
    assert plain_light(layer_files(tmp_path)).wirings == said.wirings


def test_a_file_that_is_not_there_or_cannot_be_read_makes_every_chip_one_that_may_be_lit(tmp_path: Path):
    (tmp_path / LOCAL).mkdir(parents=True)
    for files in (layer_files(tmp_path), [tmp_path / "probe.toml"]):
        said = plain_light(files)
        assert (said.wirings, said.is_said) == (EVERY_CHIP, False)


def test_each_chip_is_looked_for_at_the_address_that_is_stated_if_it_can_have_that(tmp_path: Path):
    say(tmp_path, LOCAL, "[light]\nbus = 3\naddress = 0x41\nenable_line = 17\n")
    assert not plain_light(layer_files(tmp_path)).is_said, "a tlc59116 cannot have it"
    assert plain_light(layer_files(tmp_path)).wirings == (
        LightWiring(chip="tlc59116", bus=3, enable_line=17),
        LightWiring(chip="pca9685", bus=3, address=0x41, enable_line=17),
    )


def test_settings_that_have_changed_since_the_last_start_say_one_place_and_the_last_good_ones_another(tmp_path: Path):
    say(tmp_path, LOCAL, f'data = "{tmp_path}"\n[light]\nbus = 3\n')
    say(tmp_path, LAST_GOOD, "[light]\nbus = 1\n")
    assert plain_light(layer_files(tmp_path)).wirings == (LightWiring(bus=3), LightWiring(bus=1))
