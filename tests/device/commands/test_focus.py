"""`python -m device focus` of the virtual probe, as typed, in simulated time: what is told, and that it ends dark."""

import io
import re
import signal
import sys
from contextlib import closing

import pytest
from simulated_time_probe import simulate_time

from device.__main__ import main
from device.assembly import probe
from device.hardware.tlc59116 import Tlc59116
from device.instrument.acquisition.bench import DARK
from device.records.store import Store
from device.simulation.chips.tlc59116_chip import Tlc59116Chip

SETTINGS = 'serial = "SIM-0001"\n'
LINE = re.compile(
    r"mean \d+\.\d counts, brightest \(99\.9 %\) \d+ counts, saturated \d+\.\d\d% of pixels, "
    r"sharpness (\S+), (\d+)% of the best, (\S+)"
)


class Focus:
    """Runs the verb; `lit` is the light at each line, `light` that of now, `out` and `errors` what was printed."""

    def __init__(self, folder, monkeypatch, capsys):
        self._folder, self._capsys, self._patch = folder, capsys, monkeypatch
        self.chips, self.lit, self.interrupt_at, self.signal = [], [], None, signal.SIGINT
        monkeypatch.chdir(folder)
        self.clock = simulate_time(monkeypatch)
        monkeypatch.setattr(probe, "Tlc59116Chip", self._chip)

    def _chip(self, **options):
        self.chips.append(Tlc59116Chip(**options))
        return self.chips[-1]

    @property
    def light(self):
        return self.chips[-1].ratio_at(self.clock.monotonic())

    def run(self, *arguments, settings="", scene=""):
        (self._folder / "probe.toml").write_text(SETTINGS + settings)
        (self._folder / "scene.toml").write_text(scene)
        written = Lines(self._at_line)
        self._patch.setattr(sys, "stdout", written)
        common = ("--simulate", "--config", "probe.toml", "--scene", "scene.toml")
        code = main(["focus", *common, *arguments])
        self.out, self.errors = written.getvalue().splitlines(), self._capsys.readouterr().err.splitlines()
        return code

    def _at_line(self, text):
        if not text.startswith("mean "):
            return
        self.lit.append(self.light)
        if len(self.lit) == self.interrupt_at:
            signal.raise_signal(self.signal)


class Lines(io.StringIO):
    """What is printed; `written` is told each part of it."""

    def __init__(self, written):
        super().__init__()
        self._written = written

    def write(self, text):
        self._written(text)
        return super().write(text)


@pytest.fixture
def focus(tmp_path, monkeypatch, capsys):
    return Focus(tmp_path, monkeypatch, capsys)


def test_each_second_says_how_bright_and_sharp_the_image_is_by_name_and_unit(focus):
    began_s = focus.clock.monotonic()
    assert focus.run("--lines", "3") == 0
    *lines, advice = focus.out
    assert len(lines) == 3
    found = [LINE.fullmatch(line) for line in lines]
    assert all(found), lines
    assert 3.0 <= focus.clock.monotonic() - began_s < 5.0
    best = 0.0
    for sharpness, percent, said_best in (match.groups() for match in found):
        best = max(best, float(sharpness))
        assert float(said_best) == best
        assert int(percent) == pytest.approx(100 * float(sharpness) / best, abs=1)
    assert advice.startswith("Bright enough: ")
    assert "at most 0.1%. It saturates at 1." in advice
    assert advice.endswith("times the light: raise light.ratio, camera.exposure_us and camera.gain by less in all.")
    assert focus.lit == [pytest.approx((0.6,) * 4, abs=0.01)] * 3
    assert focus.light == DARK
    assert not (focus._folder / "var").exists()


def test_one_side_alone_at_a_brightness_of_its_own(focus):
    assert focus.run("--side=-x", "--ratio", "0.2", "--lines", "1") == 0
    assert focus.lit == [pytest.approx((0.0, 0.0, 0.2, 0.0), abs=0.01)]
    assert focus.light == DARK


def test_a_saturated_scene_says_so_and_what_to_lower(focus):
    assert focus.run("--lines", "2", settings="[camera]\ngain = 16.0\n") == 0
    line, advice = focus.out[-2:]
    assert float(re.search(r"saturated (\S+)% of", line).group(1)) > 0.1
    assert "brightest (99.9 %) 255 counts" in line
    assert re.match(r"Too bright: \S+% of the pixels are saturated, above 0\.1%\. Lower ", advice)
    assert advice.endswith(
        "camera.gain (16, at least 1), then light.ratio, then camera.exposure_us (4000 us, at least 10)."
    )


def test_a_dark_scene_says_what_to_raise_as_far_as_it_goes(focus):
    assert focus.run("--lines", "2", "--ratio", "0.01") == 0
    assert focus.out[-1].startswith("Too dark: the mean is ")
    raised = "light.ratio, then camera.exposure_us (4000 us, at most 33333), then camera.gain (1, at most 16)."
    assert focus.out[-1].endswith(f" counts above dark, below 6. Raise {raised}")


def test_foreign_light_is_told_by_its_setting(focus):
    assert focus.run("--lines", "1", scene='[[faults]]\nkind = "ambient_light"\nratio = 0.5\n') == 0
    assert re.match(r"Without light the mean is \S+ counts, above light\.max_dark_counts, 24: shade", focus.out[-1])


@pytest.mark.parametrize("light", ["", "[light]\nenable_line = 17\n"])
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_ctrl_c_or_a_terminal_that_is_gone_ends_it_dark_with_the_last_word(focus, light, sent):
    focus.interrupt_at, focus.signal = 2, sent
    assert focus.run(settings=light) == 0
    assert len(focus.out) == 3
    assert all(any(ratio) for ratio in focus.lit)
    assert focus.out[-1].startswith("Bright enough")
    assert focus.light == DARK


@pytest.mark.parametrize("light", ["", "enable_line = 17\n"])
def test_the_budget_of_the_light_ends_it_dark(focus, light):
    assert focus.run(settings=f"[light]\nmax_on_s = 3.0\n{light}") == 0
    assert 2 <= len(focus.lit) <= 3
    assert focus.errors[-1].startswith(
        "E209 The LEDs were on for 3 s in the last 4 s, above 3 s. Let the LEDs rest for"
    )
    assert focus.light == DARK


@pytest.mark.parametrize("ratio", ["0", "-0.1", "1.01", "nan"])
def test_a_ratio_out_of_range_is_refused_before_anything_is_opened(focus, ratio):
    assert focus.run(f"--ratio={ratio}") == 1
    assert (focus.out, focus.chips) == ([], [])
    assert focus.errors[-1].startswith(f"ratio is {float(ratio)}".removesuffix(".0"))


def test_no_lines_are_refused_before_anything_is_opened(focus):
    assert focus.run("--lines", "0") == 1
    assert (focus.out, focus.chips) == ([], [])
    assert focus.errors[-1].startswith("lines is 0")


@pytest.mark.parametrize("fault", ['kind = "led_open"\nside = "+x"', 'kind = "camera_stall"\nfrom_s = 2.5'])
def test_a_part_that_fails_ends_it_dark_with_its_code(focus, fault):
    assert focus.run(scene=f"[[faults]]\n{fault}\n") == 1
    assert re.match(r"E[12]\d\d ", focus.errors[-1])
    assert focus.light == DARK


def test_a_print_that_fails_leaves_it_dark(focus, monkeypatch):
    """As into `head`, which has seen enough."""

    def broken(text):
        raise BrokenPipeError

    monkeypatch.setattr(focus, "_at_line", broken)
    monkeypatch.setattr("os.dup2", lambda *_: None)
    monkeypatch.setattr(Lines, "fileno", lambda self: 1)
    assert focus.run("--lines", "3") == 1
    assert focus.light == DARK


def test_the_light_goes_off_before_parts_are_closed(focus, monkeypatch):
    seen, close = [], Tlc59116.close

    def noted(chip):
        seen.append(focus.light)
        close(chip)

    monkeypatch.setattr(Tlc59116, "close", noted)
    assert focus.run("--lines", "1") == 0
    assert seen == [DARK]


def test_the_hours_of_the_leds_are_counted_where_they_are_kept(focus):
    folder = focus._folder / "var"
    Store(folder).close()
    assert focus.run("--lines", "3", settings=f'data = "{folder}"\n') == 0
    with closing(Store(folder)) as store:
        assert 3.0 <= store.light_on_s < 5.0


def test_a_load_cell_that_is_at_fault_keeps_nobody_from_focusing(focus):
    assert focus.run("--lines", "1", scene="[cell]\nzero_counts = 60000.0\n") == 0


def test_a_real_probe_lists_what_failed_and_asks_for_no_load_cell(tmp_path, capsys):
    parts = f'serial = "TSIS-0007"\n[light]\nbus = 97\n[camera]\nindex = 97\n[cell]\ndevice = "{tmp_path}/none"\n'
    (tmp_path / "probe.toml").write_text(parts)
    code = main(["focus", "--root", str(tmp_path), "--config", str(tmp_path / "probe.toml")])
    told = capsys.readouterr().err.splitlines()
    assert code == 1
    assert sorted(line.split()[0] for line in told if line.startswith("E")) == ["E101", "E201"]
