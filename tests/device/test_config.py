"""Settings: the defaults hold, both ends of every bound are taken, and what lies beyond is refused by its name."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, get_args

import pytest
from pydantic import ValidationError
from pydantic.dataclasses import dataclass

from device.config import (
    HELD_HZ,
    CameraSection,
    Config,
    Conflict,
    LightSection,
    PressSection,
    Section,
    SerialNumber,
    conflict,
    simulated_config,
)
from device.config_chips import RawMode
from device.errors import ConfigError
from device.files.toml_record import STRICT, InvalidRecord, from_table
from device.hardware.light_keeper import HOLD_S
from device.measurement.quantities import Bound, InvalidQuantity
from device.provisioning.identity import SERIAL
from device.settings.layers import read_config

BOUNDS = [
    ("camera.width_px", 64, 4096),
    ("camera.height_px", 64, 4096),
    ("camera.exposure_us", 10, 33_333),  # one frame of 30 Hz
    ("camera.gain", 1.0, 16.0),
    ("camera.mm_per_px_x", 1e-4, 1.0),
    ("camera.mm_per_px_y", 1e-4, 1.0),
    ("camera.index", 0, 99),
    ("camera.late_frames", 1.5, 100.0),
    ("camera.tear_counts", 0.5, 255.0),
    ("light.bus", 0, 255),
    ("light.address", 0x60, 0x6F),
    ("light.pwm_hz", 24.0, 1526.0),
    ("light.oscillator_hz", 20e6, 30e6),
    ("light.max_dark_counts", 0.0, 100.0),
    ("light.min_side_ratio", 0.01, 0.9),
    ("light.max_dimming_ratio", 0.01, 0.9),
    ("light.min_contrast_ratio", 0.01, 0.9),
    ("light.max_on_s", 1.0, 3600.0),
    ("light.untouched_s", 0.5, 60.0),
    ("light.enable_line", 0, 511),
    ("cell.baud", 300, 4_000_000),
    ("cell.station", 1, 999),
    ("cell.sensitivity_counts_per_n", 1.0, 1e7),
    ("cell.tare_spread_n", 0.0001, 1.0),
    ("cell.commissioned_tare_counts", -(2.0**23), 2.0**23),
    ("cell.tare_drift_n", 0.01, 5.0),
    ("cell.max_load_n", 1.0, 100.0),
    ("press.band_ratio", 0.005, 0.2),
    ("press.contact_n", 0.005, 0.06),  # three quarters of the smallest force of a ramp
    ("press.steady_n", 0.001, 1.0),
    ("press.overload_n", 0.72, 50.0),  # 1.2 times the largest force of a ramp
    ("press.max_rate_n_per_s", 0.05, 5.0),
    ("press.max_offset_mm", 0.5, 30.0),
    ("press.timeout_s", 1.0, 3600.0),
    ("store.min_free_mb", 1.0, 1e6),
    ("store.warn_free_mb", 50.0, 1e6),  # what a press needs
    ("clock.max_jump_s", 0.1, 3600.0),
    ("server.port", 0, 65_535),
]


def section_with(name, value):
    section, _, key = name.partition(".")
    return getattr(getattr(from_table(Config, {section: {key: value}}), section), key)


@pytest.fixture
def read(tmp_path):
    def read_text(text):
        (tmp_path / "probe.toml").write_text(text)
        return read_config(tmp_path / "probe.toml")

    return read_text


def test_an_empty_file_is_the_defaults_and_they_hold_their_own_bounds(read):
    assert read("") == Config()


def test_the_simulated_probe_has_its_own_serial_certificate_and_data_folder():
    real, simulated = Config(), simulated_config()
    assert simulated.serial == "SIM-0001"
    assert simulated.calibration.is_file()
    assert simulated.data != real.data
    assert simulated.camera == real.camera
    assert simulated.press == real.press


def test_only_this_machine_is_served_unless_told_otherwise():
    assert Config().server.host == "127.0.0.1"


def test_what_is_written_holds_and_the_rest_stays(read):
    config = read('serial = "TSIS-0042"\npaper_model = "m"\n[light]\nratio = [0.1, 0.2, 0.3, 1.0]\n[press]\n'
                  "target_n = 2\noverload_n = 4\n")  # fmt: skip
    assert (config.serial, config.paper_model, config.light.ratio) == ("TSIS-0042", Path("m"), (0.1, 0.2, 0.3, 1.0))
    assert config.press.target_n == 2
    assert config.camera == CameraSection()


@pytest.mark.parametrize(("old", "new"), [("model", "paper_model"), ("profile_model", "standard_model")])
def test_a_setting_of_an_earlier_version_is_read_unless_its_new_name_says_something_too(read, old, new):
    assert getattr(read(f'{old} = "m"\n'), new) == Path("m")
    with pytest.raises(ConfigError, match=f"{old} is 'm', but must be called {new} since .*: remove the old name"):
        read(f'{old} = "m"\n{new} = "n"\n')


@pytest.mark.parametrize(("name", "low", "high"), BOUNDS)
def test_both_ends_of_every_bound_are_taken(name, low, high):
    assert [section_with(name, value) for value in (low, high)] == [low, high]


@pytest.mark.parametrize(("name", "low", "high"), BOUNDS)
def test_beyond_its_bound_every_setting_is_refused_by_its_name(name, low, high):
    step = 1 if isinstance(low, int) else 1e-6
    for value in (low - step, high + step, float("nan")):
        with pytest.raises(InvalidQuantity, match=f"^{name} is"):
            section_with(name, value)


def test_the_mode_is_one_of_those_there_are(read):
    assert read('[press]\nmode = "precise"\n').press.mode == "precise"
    with pytest.raises(ConfigError, match="press.mode is 'fast', but must be 'quick', .* or 'paper'"):
        read('[press]\nmode = "fast"\n')


def test_the_load_cells_protocol_is_one_of_those_there_are(read):
    assert read('[cell]\nprotocol = "mantracourt"\n').cell.protocol == "mantracourt"
    with pytest.raises(ConfigError, match="cell.protocol is 'modbus', but must be 'openscale' or 'mantracourt'"):
        read('[cell]\nprotocol = "modbus"\n')


def test_a_pca9685_has_the_address_of_the_common_board_unless_given():
    assert LightSection(chip="pca9685").chip_address == 0x40
    assert LightSection(chip="pca9685", address=0x41).chip_address == 0x41


def test_an_exposure_of_whole_periods_of_the_pca9685_is_taken_and_any_other_refused_with_the_nearest(read):
    assert read('[light]\nchip = "pca9685"\n[camera]\nexposure_us = 3932\n').camera.exposure_us == 3932
    with pytest.raises(ConfigError, match=r"camera\.exposure_us is 4000, .* periods of 655\.36 us: set .*, 3932\."):
        read('[light]\nchip = "pca9685"\n')


def test_the_period_is_that_of_the_oscillator_as_measured(read):
    """6 periods at 25.6 MHz are 3840 us."""
    settings = '[light]\nchip = "pca9685"\noscillator_hz = 25.6e6\n[camera]\nexposure_us = '
    assert read(settings + "3840\n").light.pwm_clock.period_us == pytest.approx(640.0)
    with pytest.raises(ConfigError, match=r"set the nearest one, 3840\."):
        read(settings + "3932\n")


def test_a_period_longer_than_a_frame_is_refused(read):
    with pytest.raises(ConfigError, match=r"light\.pwm_hz is 24\.0, .* fits into a frame of 33333 us"):
        read('[light]\nchip = "pca9685"\npwm_hz = 24\n')


def test_a_tlc59116_takes_any_exposure(read):
    """At 97 kHz any exposure sees hundreds of periods."""
    assert read("[camera]\nexposure_us = 4001\n").camera.exposure_us == 4001


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[camera]\nexposure_ms = 4\n", r"camera\.exposure_ms .*did you mean camera\.exposure_us"),
        ("[pres]\ntarget_n = 0.5\n", "did you mean press"),
        ("[camera]\nwidth_px = 768.0\n", r"camera\.width_px is 768\.0, but must be a valid integer"),
        ("[camera]\nmm_per_px_x = 0.0\n", "mm_per_px_x is 0"),
        ('[light]\nchip = "tlc59108"\n', r"light\.chip is 'tlc59108', but must be 'tlc59116' or 'pca9685'"),
        ("[light]\nchip = []\n", r"light\.chip is \[\]"),
        ("[light]\naddress = 0x68\n", r"light\.address is 0x68, but must be not one that every tlc59116 answers at"),
        ("[light]\naddress = 0x40\n", r"light\.address is 64, but must be at least 96 and at most 111 of a tlc59116"),
        ('[light]\nchip = "pca9685"\naddress = 0x70\n', r"light\.address is 0x70, .*every pca9685"),
        ("[light]\nratio = [0.6, 0.6, 0.6]\n", r"light\.ratio\[3\] is missing"),
        ("[light]\nratio = [0.6, 0.6, 0.6, 0.6, 0.6]\n", r"light\.ratio is .*at most 4 items"),
        ("[light]\nratio = 0.6\n", r"light\.ratio is 0\.6, but must be a valid array"),
        ("[light]\nratio = [0.6, 0.6, 0.6, 0.0]\n", r"light\.ratio\[3\] is 0\.0, but must be above 0"),
        ("[light]\nratio = [0.6, 0.6, 0.6, 1.1]\n", r"light\.ratio\[3\] is 1\.1"),
        ("[light]\ncommissioned_counts = [50, 50, 50]\n", r"light\.commissioned_counts\[3\] is missing"),
        ("[light]\ncommissioned_counts = [50, 50, 50, 0.9]\n", r"light\.commissioned_counts\[3\] is 0\.9"),
        ("[press]\ntarget_n = nan\n", r"press\.target_n is nan"),
        ("[press]\noverload_n = 0.71\n", r"press\.overload_n is 0\.71, but must be at least 0\.72"),
        ("[server]\nport = 65536\n", r"server\.port is 65536"),
        ('[server]\nhost = ""\n', r"server\.host is '', but must be at least 1 character"),
        ("serial = 7\n", "serial is 7"),
        ("camera = 3\n", r"write it as \[camera\]"),
        ("[camera\n", "valid TOML"),
    ],
)
def test_a_file_that_is_wrong_is_refused_with_path_setting_and_fault_code(read, text, words):
    with pytest.raises(ConfigError, match=rf"probe\.toml: .*{words}") as refusal:
        read(text)
    assert refusal.value.code == "E001"


def test_a_missing_file_is_refused_by_its_path(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.toml.*No such file"):
        read_config(tmp_path / "none.toml")


@dataclass(frozen=True, config=STRICT)
class TwoChips(Config):
    """A probe with a second LED driver."""

    more_light: LightSection = LightSection(bus=0)


@pytest.mark.parametrize("address", [{"address": 0x60}, {}])
def test_two_chips_at_one_address_of_one_bus_are_refused_by_both_names(address):
    chips = {"light": {"bus": 1, "address": 0x60}, "more_light": {"bus": 1} | address}
    with pytest.raises(InvalidQuantity, match=r"^more_light\.address is 0x60, .*correct it or light\.address"):
        from_table(TwoChips, chips)


@pytest.mark.parametrize("other", [{"bus": 2, "address": 0x62}, {"bus": 1, "address": 0x63}])
def test_chips_may_share_a_bus_or_an_address(other):
    chips = {"light": LightSection(bus=1, address=0x62), "more_light": LightSection(**other)}
    assert TwoChips(**chips).more_light.bus == other["bus"]


def test_settings_made_by_the_program_are_checked_as_those_of_a_file():
    for wrong in ({"frame_rate_hz": 0.9}, {"frame_rate_hz": "30"}, {"frame_rate": 30.0}, {"exposure_us": 40_000}):
        with pytest.raises(ValidationError):
            CameraSection(**wrong)
    with pytest.raises(ValidationError):
        replace(CameraSection(), frame_rate_hz=0.9)


def test_an_exposure_longer_than_a_frame_is_refused_with_the_frames_duration():
    with pytest.raises(InvalidQuantity, match="at most 10000 us, one frame"):
        from_table(Config, {"camera": {"frame_rate_hz": 100.0, "exposure_us": 10_001}})


def test_a_frame_is_the_whole_sensor_pixel_by_pixel_unless_told_otherwise():
    assert CameraSection().raw_mode == RawMode.whole(768, 492)
    assert CameraSection().sensor_scale == CameraSection().scale


def test_a_larger_sensor_has_smaller_pixels_on_the_face():
    """1070 of its columns are 768 of a frame, of 0.03125 mm; 800 rows are 492 of 0.03646 mm: square within 0.03 %."""
    camera = CameraSection(sensor_width_px=1280, sensor_height_px=800, crop_width_px=1070, raw_format="R10")
    assert camera.raw_mode == RawMode((1280, 800), (1070, 800), (768, 492), "R10")
    assert camera.sensor_scale.mm_per_px_x == pytest.approx(0.0224299, abs=1e-7)
    assert camera.sensor_scale.mm_per_px_y == pytest.approx(0.0224229, abs=1e-7)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"sensor_width_px": 640}, r"camera.sensor_width_px is 640, but must be at least 768 and .*frame's or more"),
        ({"sensor_height_px": 400, "crop_height_px": 300}, "camera.sensor_height_px is 400, but must be at least 492"),
        ({"crop_width_px": 800}, r"camera.crop_width_px is 800, but must be at least 768 and at most 768 px"),
        ({"sensor_height_px": 800, "crop_height_px": 400}, "camera.crop_height_px is 400, but must be at least 492"),
        ({"raw_format": "R10_CSI2P"}, "camera.raw_format is 'R10_CSI2P', but must be 'R8', 'R10', 'R12' or 'R16'"),
    ],
)
def test_a_part_of_the_sensor_that_is_not_on_it_or_less_than_a_frame_is_refused(settings, message):
    with pytest.raises(InvalidQuantity, match=message):
        from_table(Config, {"camera": settings})


def test_the_band_lies_around_the_target_by_its_ratio():
    assert PressSection(target_n=0.8, band_ratio=0.1).band_n == pytest.approx((0.72, 0.88))


@pytest.mark.parametrize("target_n", [0.1, 20.0])
def test_both_ends_of_the_targets_bound_are_taken(target_n):
    assert PressSection(target_n=target_n, contact_n=0.01, overload_n=50.0).target_n == target_n


@pytest.mark.parametrize("target_n", [0.09, 20.1])
def test_a_target_beyond_its_bound_is_refused(target_n):
    with pytest.raises(InvalidQuantity, match=r"^press\.target_n is"):
        from_table(Config, {"press": {"target_n": target_n, "contact_n": 0.01, "overload_n": 50.0}})


def test_the_overload_lies_above_the_hold_and_the_contact_below_half_of_it():
    with pytest.raises(InvalidQuantity, match=r"^press\.overload_n is 0\.95, but must be at least 0\.96 "):
        from_table(Config, {"press": {"target_n": 0.8, "overload_n": 0.95}})
    with pytest.raises(InvalidQuantity, match=r"^press\.contact_n is 0\.055, but must be .* at most 0\.05 "):
        from_table(Config, {"press": {"target_n": 0.1, "contact_n": 0.055}})


@dataclass(frozen=True, config=STRICT)
class Tank(Section):
    level_mm: Annotated[float, Bound(1.0, 100.0, "mm")] = 20.0
    height_mm: Annotated[float, Bound(10.0, 200.0, "mm")] = 50.0

    def conflicts(self) -> Iterator[Conflict]:
        yield from conflict("tank.level_mm", self.level_mm, Bound(1.0, self.height_mm, "mm"), "tank.height_mm")


def problems_of(**table):
    with pytest.raises(InvalidRecord) as refusal:
        from_table(Tank, table)
    return refusal.value.problems


def test_what_does_not_fit_together_names_the_setting_and_those_it_has_to_fit():
    [problem] = problems_of(level_mm=60.0)
    assert isinstance(problem, Conflict)
    assert problem.others == ("tank.height_mm",)
    assert str(problem).endswith("at most 50 mm: correct it or tank.height_mm.")


def test_what_does_not_fit_together_may_say_better_what_to_do():
    assert str(Conflict("tank.level_mm", 60, "below the wall", ("tank.height_mm",), "drain it")) == (
        "tank.level_mm is 60, but must be below the wall: drain it."
    )


def test_settings_that_do_not_hold_alone_are_not_compared():
    [problem] = problems_of(height_mm=5.0)
    assert problem.quantity == "height_mm"


def test_frames_that_come_too_slowly_to_hold_the_enable_line_from_one_to_the_next_are_refused(read):
    slow = "[camera]\nframe_rate_hz = 7.0\n"
    assert read(slow).light.enable_line is None
    words = r"is 7\.0, but must be at least 8 .* Hz, to hold the enable line .* or light\.enable_line"
    with pytest.raises(ConfigError, match=words):
        read(slow + "[light]\nenable_line = 17\n")
    assert CameraSection().late_frames / HELD_HZ < HOLD_S


@pytest.mark.parametrize(
    ("table", "told"),
    [
        *(
            (f'serial = "{serial}"', "serial is .* must be 1 to 63 letters, digits")
            for serial in ("", "A/B", "x\\ny", "é")
        ),
        ('[webhook]\nurl = "https://a:b@hospital.example/x"', "webhook.url is .* without user, password, query or"),
        ('[dicom]\nown_title = "A\\\\B"', r"dicom.own_title is .* must be 1 to 16 characters of ASCII, no backslash"),
        ('[dicom]\ninstitution = "A\\nB"', "dicom.institution is .* must be one line without a backslash"),
    ],
)
def test_text_of_another_form_is_refused_in_words(read, table, told):
    with pytest.raises(ConfigError, match=told):
        read(table)


def test_a_serial_number_is_what_provisioning_takes_for_one():
    """Written twice, for provisioning runs where no package is installed."""
    [field] = [one for one in get_args(SerialNumber) if getattr(one, "metadata", None)]
    [pattern] = [one.pattern for one in field.metadata if hasattr(one, "pattern")]
    assert pattern == f"^{SERIAL.pattern}$"
