"""Frames of a bench to a recording: as the probe's own, or everything that is wrong named by its line."""

import csv
from dataclasses import replace

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from device.files.recording_file import read_recording
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.ramp_modes.radial_profile import press_profiles
from host_tools.__main__ import app
from host_tools.calibration.bench_folder import NEEDED, PressOnBench, bench_recording
from host_tools.calibration.phantom import PhantomProtocol, phantom_recording
from host_tools.scenes.probe_file import simulated_probe

PRESS = PressOnBench("A1", "2026-11-02T09:30:00+01:00", 4000.0, 1.0)
LEDS = ("led_x", "led_y", "led_minus_x", "led_minus_y")


@pytest.fixture(scope="module")
def recorded(tables):
    protocol = PhantomProtocol(tuple(np.linspace(0.1, 0.64, 8)), frames=1)
    return phantom_recording(Inclusion(12.0, 6.0, 60.0), tables, seed=3, protocol=protocol)


def written(folder, recorded, *, columns=(*NEEDED, *LEDS), shift=0):
    """Write frames and table of a recording as a bench would have them."""
    folder.mkdir(exist_ok=True)
    with (folder / "frames.csv").open("w", newline="", encoding="utf-8-sig") as file:
        table = csv.writer(file)
        table.writerow(columns)
        for number, frame in enumerate(recorded.frames):
            counts = frame.counts if not shift else frame.counts.astype(np.uint16) << shift % 16
            cv2.imwrite(str(folder / f"f{number}.png"), counts)
            row = (f"f{number}.png", frame.role, repr(frame.force_n), repr(frame.t_s), *map(repr, frame.led_ratio))
            table.writerow(row[: len(columns)])
    return folder / "frames.csv"


def test_a_recording_of_a_bench_reads_as_the_probes_own(recorded, tmp_path):
    table = written(tmp_path / "bench", recorded)
    found = bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())
    assert [frame.force_n for frame in found.frames] == [frame.force_n for frame in recorded.frames]
    assert (found.serial, found.truth, found.simulated) == ("SIM-0001", None, False)
    ours, theirs = (press_profiles(one)[0].as_row() for one in (found, recorded))
    assert np.array_equal(ours, theirs)


def test_ten_bits_that_lie_below_are_put_at_the_top(recorded, tmp_path):
    """A camera of 10 bit, whose program writes counts of 0 to 1023 into 16."""
    table = written(tmp_path / "bench", recorded, shift=2)
    made_by = simulated_probe()
    of_ten = replace(made_by, camera=replace(made_by.camera, bits=10))
    found = bench_recording(tmp_path / "bench", table, PRESS, of_ten)
    assert found.camera.bits == 16
    for ours, theirs in zip(found.frames, recorded.frames, strict=True):
        assert np.array_equal(ours.counts >> 8, theirs.counts)


def test_counts_of_another_sensor_than_the_files_are_refused(recorded, tmp_path):
    """Twelve bits at the lower end look like ten at the upper one, sixteen times too dark."""
    table = written(tmp_path / "bench", recorded, shift=4)
    made_by = simulated_probe()
    of_ten, of_twelve = (replace(made_by, camera=replace(made_by.camera, bits=bits)) for bits in (10, 12))
    with pytest.raises(
        InvalidQuantity, match=r"counts of the images is up to \d+, but must be of 10 bits.*camera.bits"
    ):
        bench_recording(tmp_path / "bench", table, PRESS, of_ten)
    found = bench_recording(tmp_path / "bench", table, PRESS, of_twelve)
    for ours, theirs in zip(found.frames, recorded.frames, strict=True):
        assert np.array_equal(ours.counts >> 8, theirs.counts)


def test_pixels_that_are_full_by_fewer_bits_than_the_file_says_are_refused(recorded, tmp_path):
    """Put at the top by too many bits they would be dim, and full by nobody's count."""
    table = written(tmp_path / "bench", recorded)
    for number, one in enumerate(recorded.frames):
        bright = np.minimum(one.counts.astype(np.uint16) << 4, 1023)
        cv2.imwrite(str(tmp_path / "bench" / f"f{number}.png"), bright)
    made_by = simulated_probe()
    of_twelve = replace(made_by, camera=replace(made_by.camera, bits=12))
    with pytest.raises(InvalidQuantity, match=r"full at 1023, as of 10 bits, but must be of 12 bits"):
        bench_recording(tmp_path / "bench", table, PRESS, of_twelve)


@pytest.mark.parametrize("shift", [0, 8])
def test_eight_bits_in_images_of_sixteen_become_eight(recorded, tmp_path, shift):
    """Their full scale is told in 8 bits alone."""
    table = written(tmp_path / "bench", recorded, shift=shift or 16)
    found = bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())
    assert found.camera.bits == 8
    for ours, theirs in zip(found.frames, recorded.frames, strict=True):
        assert np.array_equal(ours.counts, theirs.counts)


@pytest.mark.parametrize(("off_n", "is_refused"), [(0.002, False), (0.006, True), (-0.006, True), (0.06, True)])
def test_forces_whose_zero_is_off_are_refused(recorded, tmp_path, off_n, is_refused):
    """By the dark frames, however far it is off: no image tells it."""
    assert any(frame.role == "dark" and abs(frame.force_n) < 1e-3 for frame in recorded.frames)
    frames = tuple(replace(frame, force_n=frame.force_n + off_n) for frame in recorded.frames)
    table = written(tmp_path / "bench", replace(recorded, frames=frames))
    if not is_refused:
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())
        return
    with pytest.raises(InvalidQuantity, match=r"mean force of the dark frames is -?0.0[056]\d*, .* off every force_n"):
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())


@pytest.mark.parametrize(("off_n", "is_refused"), [(0.002, False), (0.006, True), (0.025, True), (-0.006, True)])
def test_a_cell_that_creeps_once_the_dark_frames_are_taken_is_refused(recorded, tmp_path, off_n, is_refused):
    """Dark frames read zero: only lit ones of the untouched face tell it."""
    frames = tuple(one if one.role == "dark" else replace(one, force_n=one.force_n + off_n) for one in recorded.frames)
    table = written(tmp_path / "bench", replace(recorded, frames=frames))
    if not is_refused:
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())
        return
    with pytest.raises(
        InvalidQuantity, match=r"^mean force of the lit, untouched frames is -?0\.0[0-9]+, .*tare while"
    ):
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())


def test_an_image_that_stands_in_two_lines_is_refused_by_its_name_and_by_its_pixels(recorded, tmp_path):
    """A spreadsheet that fills a name down gives the force of one frame to another: it read as two inclusions."""
    table = written(tmp_path / "bench", recorded)
    lines = table.read_text("utf-8-sig").splitlines()
    last = len(recorded.frames)
    lines[last] = lines[last].replace(f"f{last - 1}.png", f"f{last - 2}.png")
    table.write_text("\n".join(lines))
    (tmp_path / "bench" / f"f{last - 4}.png").write_bytes((tmp_path / "bench" / f"f{last - 3}.png").read_bytes())
    with pytest.raises(InvalidQuantity) as refused:
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())
    assert str(refused.value).splitlines() == [
        f"frames.csv, line {last - 1}: image is f{last - 3}.png, that of line {last - 2}, "
        "but must be another in each line: correct the table.",
        f"frames.csv, line {last + 1}: image is f{last - 2}.png, that of line {last}, "
        "but must be another in each line: correct the table.",
    ]


def test_a_jpeg_is_refused_whatever_its_name_says(recorded, tmp_path):
    """What it loses reads as an inclusion that is not round."""
    table = written(tmp_path / "bench", recorded)
    _, content = cv2.imencode(".jpg", recorded.frames[-1].counts)
    (tmp_path / "bench" / f"f{len(recorded.frames) - 1}.png").write_bytes(content.tobytes())
    with pytest.raises(InvalidQuantity, match="must be a PNG or TIFF: save frames without loss"):
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())


def test_everything_that_is_wrong_is_named_at_once_by_its_line(recorded, tmp_path):
    table = written(tmp_path / "bench", recorded)
    lines = table.read_text("utf-8-sig").splitlines()
    cv2.imwrite(str(tmp_path / "bench" / "small.png"), np.zeros((20, 20), np.uint8))
    cv2.imwrite(str(tmp_path / "bench" / "colour.png"), np.zeros((492, 768, 3), np.uint8))
    wrong = {
        1: ("f0.png,flat,0,0,1,1,1,1", "role is 'flat'"),
        2: ("none.png,dark,0,0,1,1,1,1", "No such file"),
        3: ("../f1.png,dark,0,0,1,1,1,1", "a path inside the folder"),
        4: ("small.png,dark,0,0,1,1,1,1", "20 x 20 px"),
        5: ("colour.png,dark,0,0,1,1,1,1", "3 colours"),
        6: ("f1.png,press,nan,0,1,1,1,1", "force_n is nan"),
        7: ("f1.png,press,0.5,0,2,1,1,1", "led_ratio is 2.0"),
        8: ("f1.png,press,0.5", "too many or too few"),
        9: ("f1.png,press,0;5,0,1,1,1,1", "'0;5'"),
        10: ("f1.png,press,104,0,1,1,1,1", "force_n is 104.0, but must be at least -0.1 and at most 5 N"),
        11: ("f1.png,reference,-0.5,0,1,1,1,1", "force_n is -0.5"),
    }
    for place, (line, _) in wrong.items():
        lines[place] = line
    table.write_text("\n".join(lines))
    with pytest.raises(InvalidQuantity) as refused:
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())
    said = str(refused.value).splitlines()
    assert len(said) == len(wrong)
    for place, (_, what) in wrong.items():
        assert f"line {place + 1}:" in said[place - 1]
        assert what in said[place - 1]


def test_a_dark_frame_that_the_table_says_is_lit_is_refused(recorded, tmp_path):
    frames = (replace(one, led_ratio=(0.6,) * 4) if one.role == "dark" else one for one in recorded.frames)
    table = written(tmp_path / "bench", replace(recorded, frames=tuple(frames)))
    with pytest.raises(InvalidQuantity, match=r"LEDs of a dark frame is 0.6, 0.6, 0.6, 0.6, but must be 0, 0, 0, 0"):
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())


@pytest.mark.parametrize(("mark", "named"), [(";", "';'"), ("\t", "tabs")])
def test_a_table_of_a_spreadsheet_that_parts_otherwise_is_told_once(recorded, tmp_path, mark, named):
    table = written(tmp_path / "bench", recorded)
    table.write_text(table.read_text("utf-8-sig").replace(",", mark).replace(".", ","))
    with pytest.raises(InvalidQuantity) as refused:
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())
    assert str(refused.value) == (
        f"first line of {table} is parted by {named}, but must be parted by commas: "
        "save it with commas and decimal points."
    )


def test_empty_lines_are_left_out_and_the_others_keep_their_numbers(recorded, tmp_path):
    table = written(tmp_path / "bench", recorded)
    lines = table.read_text("utf-8-sig").splitlines()
    spaced = [lines[0], "", *lines[1:3], ",,,,,,,", *lines[3:], 3 * ",", " , ,"]
    table.write_text("\n".join(spaced))
    assert len(bench_recording(tmp_path / "bench", table, PRESS, simulated_probe()).frames) == len(recorded.frames)
    table.write_text("\n".join(spaced).replace(lines[3], "f2.png,flat,0,0,1,1,1,1"))
    with pytest.raises(InvalidQuantity, match=r"^frames.csv, line 6: role is 'flat'"):
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())


@pytest.mark.parametrize(
    ("columns", "what"),
    [
        (("file", "role", "force_n"), "column t_s"),
        (("file", "role", "force_n", "t_s", "colour"), "column colour"),
        ((*NEEDED, "led_x"), "columns of LEDs"),
    ],
)
def test_columns_that_are_not_as_they_must_be_are_refused(recorded, tmp_path, columns, what):
    table = written(tmp_path / "bench", recorded, columns=columns)
    with pytest.raises(InvalidQuantity, match=what):
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())


def test_missing_roles_and_a_time_without_a_zone_are_refused(recorded, tmp_path):
    pressed = replace(recorded, frames=tuple(recorded.with_role("press")))
    table = written(tmp_path / "bench", pressed)
    with pytest.raises(InvalidQuantity, match="dark frames is 0") as refused:
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())
    assert "reference frames is 0" in str(refused.value)
    with pytest.raises(InvalidQuantity, match="started_at"):
        replace(PRESS, started_at="2026-11-02T09:30:00")


def test_a_file_that_is_to_show_two_things_is_refused(recorded, tmp_path):
    table = written(tmp_path / "bench", recorded)
    dark = next(number for number, frame in enumerate(recorded.frames) if frame.role == "dark")
    last = len(recorded.frames) - 1
    table.write_text(table.read_text("utf-8-sig").replace(f"f{last}.png", f"f{dark}.png"))
    with pytest.raises(InvalidQuantity, match=rf"image is f{dark}\.png, that of line {dark + 2}, but must be another"):
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())


def test_images_of_two_depths_are_refused_with_those_that_differ(recorded, tmp_path):
    table = written(tmp_path / "bench", recorded)
    last = tmp_path / "bench" / f"f{len(recorded.frames) - 1}.png"
    cv2.imwrite(str(last), cv2.imread(str(last), cv2.IMREAD_UNCHANGED).astype(np.uint16) << 8)
    with pytest.raises(InvalidQuantity, match=f"images is of 8 and of 16 bit, .* the rarer are {last.name}"):
        bench_recording(tmp_path / "bench", table, PRESS, simulated_probe())


def test_a_table_that_is_not_there_is_told_in_a_sentence(tmp_path):
    with pytest.raises(InvalidQuantity, match="No such file.*a table of comma separated values"):
        bench_recording(tmp_path, tmp_path / "none.csv", PRESS, simulated_probe())


def test_more_frames_than_memory_holds_are_refused_before_any_is_read(tmp_path):
    line = "none.png,press,0.5,0\n"
    (tmp_path / "frames.csv").write_text("file,role,force_n,t_s\n" + 100_000 * line)
    with pytest.raises(InvalidQuantity, match="frames of the recording is 100000"):
        bench_recording(tmp_path, tmp_path / "frames.csv", PRESS, simulated_probe())


def test_the_command_writes_a_recording_and_nothing_of_a_bad_table(recorded, tmp_path):
    table, out = written(tmp_path / "bench", recorded), tmp_path / "ramps" / "A1.zip"
    given = ["import", str(tmp_path / "bench"), "--exposure-us", "4000", "--started-at", PRESS.started_at]
    given += ["--probe", "models/simulated_probe/probe.toml", "--out", str(out)]
    assert CliRunner().invoke(app, given).exit_code == 0
    assert read_recording(out).id == "A1"
    assert CliRunner().invoke(app, given).exit_code == 1
    out.unlink()
    table.write_text("file,role\n")
    assert CliRunner().invoke(app, given).exit_code == 1
    assert not out.exists()
