"""A recording comes back as it was written, and is refused by the name of the field that is wrong."""

import json
import shutil
import subprocess
import sys
import time
import zipfile
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from device.files.durable import synced_file
from device.files.recording_file import (
    png_of,
    read_forces,
    read_head,
    read_picture,
    read_recording,
    write_recording,
)
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.recording import GEOMETRY, CameraSettings, RecordedCell, Recording
from device.measurement.recording.tactile_image import Frame

CAMERA = CameraSettings(
    width_px=32, height_px=24, bits=8, mm_per_px_x=0.03, mm_per_px_y=0.04, exposure_us=4000.0, gain=1.5
)
ROLES = ("dark", "reference", "press", "press")


def small_recording(bits=8):
    counts = np.random.default_rng(1).integers(0, 2**bits, (4, 24, 32)).astype(f"uint{bits}")
    return Recording(
        id="one-press",
        serial="TSIS-0007",
        software="1.0",
        started_at="2026-01-02T03:04:05.678Z",
        camera=replace(CAMERA, bits=bits),
        frames=tuple(Frame(counts[i], role, 0.1 * i, 0.25 * i, (0.0, 0.2, 0.4, 1.0)) for i, role in enumerate(ROLES)),
        calibration_id="certificate",
        position_mm=(6.0, -1.5),
        truth=Inclusion(10.0, 5.0, 80.0),
        simulated=True,
        cell=RecordedCell(100_000.0, -8200.0),
        phantom_serial="PH-3",
    )


def test_axis_and_distortion_are_said_of_a_camera_that_has_them(tmp_path):
    """Of another they are absent, as in a recording of before, and then they are 0."""
    askew = replace(CAMERA, axis_x_mm=0.3, rim_distortion_percent=-2.0)
    for name, camera, said in (("plain", CAMERA, set()), ("askew", askew, set(GEOMETRY))):
        write_recording(replace(small_recording(), camera=camera), tmp_path / name)
        written = json.loads((tmp_path / name / "recording.json").read_text())["camera"]
        assert set(written) & set(GEOMETRY) == said
        assert read_recording(tmp_path / name).camera == camera
    assert written["axis_x_mm"] == 0.3


@pytest.mark.parametrize("mode", [None, "precise"])
def test_the_mode_is_said_where_it_is_known(tmp_path, mode):
    write_recording(replace(small_recording(), mode=mode), tmp_path / "press")
    assert ("mode" in json.loads((tmp_path / "press/recording.json").read_text())) is (mode is not None)
    assert read_recording(tmp_path / "press").mode == mode


def test_what_only_newer_software_says_is_no_reason_to_refuse_a_recording(folder):
    edited(folder, lambda record: record.update(mode="thorough", colour="blue"))
    assert read_recording(folder).mode is None


@pytest.fixture
def folder(tmp_path):
    write_recording(small_recording(), tmp_path / "press")
    return tmp_path / "press"


def zipped(folder, prefix=""):
    path = folder.with_suffix(".zip")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(p for p in folder.rglob("*") if p.is_file()):
            archive.write(file, prefix + str(file.relative_to(folder)))
    return path


def edited(folder, change):
    path = folder / "recording.json"
    record = json.loads(path.read_text())
    change(record)
    path.write_text(json.dumps(record))
    return folder


def with_value(folder, path, value):
    """Set the field at a dotted path, or remove it when the value is `...`."""

    def change(record):
        *way, last = (int(key) if key.isdigit() else key for key in path.split("."))
        for key in way:
            record = record[key]
        if value is ...:
            del record[last]
        else:
            record[last] = value

    return edited(folder, change)


def assert_same(found, expected):
    for a, b in zip(found.frames, expected.frames, strict=True):
        np.testing.assert_array_equal(a.counts, b.counts, strict=True)
        assert (a.role, a.t_s, a.force_n, a.led_ratio) == (b.role, b.t_s, b.force_n, b.led_ratio)
    assert replace(found, frames=()) == replace(expected, frames=())


@pytest.mark.parametrize("bits", [8, 16])
def test_a_folder_comes_back_as_it_was_written(tmp_path, bits):
    write_recording(small_recording(bits), tmp_path / "press")
    assert_same(read_recording(tmp_path / "press"), small_recording(bits))


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("prefix", ["", "press/"])
def test_a_zip_of_the_folder_or_of_its_content_comes_back_too(tmp_path, bits, prefix):
    write_recording(small_recording(bits), tmp_path / "press")
    assert_same(read_recording(zipped(tmp_path / "press", prefix)), small_recording(bits))


def test_what_need_not_be_known_may_be_absent(folder):
    for name in ("truth", "position_mm", "calibration_id", "simulated", "cell", "phantom_serial"):
        with_value(folder, name, ...)
    found = read_recording(folder)
    assert (found.truth, found.position_mm, found.calibration_id, found.simulated) == (None, (0.0, 0.0), None, False)
    assert (found.cell, found.phantom_serial) == (None, "")


def test_a_tare_that_is_not_known_is_null(folder):
    assert read_recording(with_value(folder, "cell.tare_counts", None)).cell == RecordedCell(100_000.0)


def test_the_file_on_disk_is_the_contract(folder):
    record = json.loads((folder / "recording.json").read_text())
    assert record["schema"] == "tsis.recording/1"
    assert record["device"] == {"serial": "TSIS-0007", "software": "1.0"}
    assert record["frames"][1] == {
        "file": "frames/001.png", "role": "reference", "t_s": 0.1, "force_n": 0.25, "led_ratio": [0.0, 0.2, 0.4, 1.0]
    }  # fmt: skip
    assert record["cell"] == {"counts_per_n": 100000.0, "tare_counts": -8200.0}
    assert record["truth"] == {"size_mm": 10.0, "depth_mm": 5.0, "youngs_modulus_kpa": 80.0}
    assert record["phantom_serial"] == "PH-3"
    assert sorted(p.name for p in (folder / "frames").iterdir()) == ["000.png", "001.png", "002.png", "003.png"]


@pytest.mark.parametrize("name", ["scan", "scan.zip"])
def test_a_scan_comes_back_with_its_ramps_and_is_of_another_schema(tmp_path, name):
    """Only a frame of a later press says of which: a recording of one press is what it was."""
    one = small_recording()
    scan = replace(one, frames=(*one.frames, replace(one.frames[-1], ramp=1), replace(one.frames[-1], ramp=4)))
    write_recording(scan, tmp_path / name)
    found = read_recording(tmp_path / name)
    assert_same(found, scan)
    assert {ramp: [frame.t_s for frame in frames] for ramp, frames in found.ramps().items()} == {
        0: [0.2, 0.30000000000000004], 1: [0.30000000000000004], 4: [0.30000000000000004]
    }  # fmt: skip
    if name == "scan":
        record = json.loads((tmp_path / name / "recording.json").read_text())
        assert record["schema"] == "tsis.recording/2"
        assert [frame.get("ramp") for frame in record["frames"]] == [None, None, None, None, 1, 4]


@pytest.mark.parametrize(
    ("path", "value", "quantity"),
    [
        ("schema", ..., "schema"),
        ("schema", "tsis.recording/3", "schema"),
        ("id", ..., "id"),
        ("id", 7, "id"),
        ("device", ..., "device"),
        ("device.serial", ..., "device.serial"),
        ("device.software", 1.0, "device.software"),
        ("started_at", ..., "started_at"),
        ("started_at", "yesterday", "started_at"),
        ("camera", ..., "camera"),
        ("camera", [], "camera"),
        ("camera.gain", ..., "camera.gain"),
        ("camera.gain", "1", "camera.gain"),
        ("camera.gain", True, "camera.gain"),
        ("camera.gain", float("nan"), "camera.gain"),
        ("camera.exposure_us", 0, "camera.exposure_us"),
        ("camera.bits", 12, "camera.bits"),
        ("camera.bits", 16, "camera.bits"),
        ("camera.width_px", 15, "camera.width_px"),
        ("camera.width_px", 33, "frame shape"),
        ("camera.mm_per_px_x", 0.0, "mm_per_px_x"),
        ("camera.axis_x_mm", 2.5, "camera.axis_x_mm"),
        ("camera.axis_y_mm", None, "camera.axis_y_mm"),
        ("camera.rim_distortion_percent", "1", "camera.rim_distortion_percent"),
        ("frames", ..., "frames"),
        ("frames", {}, "frames"),
        ("frames.1", "frames/001.png", "frames[1].file"),
        ("frames.1.file", ..., "frames[1].file"),
        ("frames.1.file", "frames/none.png", "frames[1].file"),
        ("frames.1.file", "frames", "frames[1].file"),
        ("frames.1.file", "recording.json", "frames[1].file"),
        ("frames.1.role", ..., "frames[1].role"),
        ("frames.1.role", "flat", "role"),
        ("frames.1.force_n", ..., "frames[1].force_n"),
        ("frames.1.force_n", None, "frames[1].force_n"),
        ("frames.1.force_n", "0.5", "frames[1].force_n"),
        ("frames.1.force_n", float("nan"), "frames[1].force_n"),
        ("frames.1.force_n", float("inf"), "frames[1].force_n"),
        ("frames.1.force_n", 1001.0, "frames[1].force_n"),
        ("frames.1.t_s", ..., "frames[1].t_s"),
        ("frames.1.t_s", float("nan"), "t_s"),
        ("frames.1.led_ratio", ..., "frames[1].led_ratio"),
        ("frames.1.led_ratio", [0.6, 0.6, 0.6], "frames[1].led_ratio"),
        ("frames.1.led_ratio", [0.6, 0.6, 0.6, 1.2], "led_ratio"),
        ("frames.1.led_ratio", [0.6, 0.6, 0.6, "x"], "led_ratio"),
        ("frames.2.ramp", None, "frames[2].ramp"),
        ("frames.2.ramp", "1", "frames[2].ramp"),
        ("frames.2.ramp", 1.0, "frames[2].ramp"),
        ("frames.2.ramp", True, "frames[2].ramp"),
        ("frames.2.ramp", -1, "ramp"),
        ("frames.2.ramp", 8, "ramp"),
        ("frames.1.ramp", 1, "ramp"),
        ("frames.2.ramp", 1, "schema"),
        ("calibration_id", 3, "calibration_id"),
        ("position_mm", 3.0, "position_mm"),
        ("position_mm", [1.0], "position_mm"),
        ("position_mm", [1.0, float("nan")], "position_mm"),
        ("position_mm", ["1", "2"], "position_mm"),
        ("mode", 3, "mode"),
        ("simulated", "no", "simulated"),
        ("simulated", 1, "simulated"),
        ("cell", 5, "cell"),
        ("cell.counts_per_n", ..., "cell.counts_per_n"),
        ("cell.counts_per_n", 0.0, "cell.counts_per_n"),
        ("cell.tare_counts", "8200", "cell.tare_counts"),
        ("cell.tare_counts", float("nan"), "cell.tare_counts"),
        ("truth", 5, "truth.size_mm"),
        ("truth", {}, "truth.size_mm"),
        ("truth.depth_mm", ..., "truth.depth_mm"),
        ("truth.depth_mm", float("nan"), "depth_mm"),
        ("truth.youngs_modulus_kpa", -80, "youngs_modulus_kpa"),
    ],
)
def test_a_wrong_field_is_refused_by_its_name(folder, path, value, quantity):
    with pytest.raises(InvalidQuantity) as refusal:
        read_recording(with_value(folder, path, value))
    assert refusal.value.quantity == quantity


@pytest.mark.parametrize("way", ["../outside.png", "frames/../../outside.png", "/{}/outside.png"])
def test_a_frame_outside_the_recording_is_not_read(folder, way):
    shutil.copy(folder / "frames/000.png", folder.parent / "outside.png")
    with pytest.raises(InvalidQuantity, match="a path inside the recording"):
        read_recording(with_value(folder, "frames.1.file", way.format(folder.parent)))


def test_a_missing_png_is_refused_in_a_zip_as_in_a_folder(folder):
    (folder / "frames/002.png").unlink()
    for path in (folder, zipped(folder)):
        with pytest.raises(InvalidQuantity, match=r"^frames\[2\]\.file is frames/002\.png, but must be a readable PNG"):
            read_recording(path)


@pytest.mark.parametrize("content", [b"", b"no picture"])
def test_what_is_no_png_is_refused(folder, content):
    (folder / "frames/002.png").write_bytes(content)
    with pytest.raises(InvalidQuantity, match=r"^frames\[2\]\.file"):
        read_recording(folder)


def test_a_png_that_ends_early_is_refused(folder):
    path = folder / "frames/002.png"
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InvalidQuantity, match=r"^frames\[2\]\.file"):
        read_recording(folder)


def test_a_colour_picture_is_refused(folder):
    cv2.imwrite(str(folder / "frames/002.png"), np.zeros((24, 32, 3), np.uint8))
    with pytest.raises(InvalidQuantity, match=r"a mono image"):
        read_recording(folder)


def test_a_frame_of_another_shape_is_refused_with_both(folder):
    cv2.imwrite(str(folder / "frames/002.png"), np.zeros((20, 30), np.uint8))
    with pytest.raises(InvalidQuantity, match=r"frame shape is .*30 x 20.*32 x 24|frame shape is .*32 x 24.*30 x 20"):
        read_recording(folder)


@pytest.mark.parametrize("text", ["", "{", "[]", "7"])
def test_a_description_that_is_none_is_refused(folder, text):
    (folder / "recording.json").write_text(text)
    with pytest.raises(InvalidQuantity, match=r"^(recording|schema) is"):
        read_recording(folder)


@pytest.mark.parametrize("name", ["none", "none.zip"])
def test_a_missing_recording_is_refused_by_its_path(tmp_path, name):
    with pytest.raises(InvalidQuantity, match=name):
        read_recording(tmp_path / name)


def test_a_zip_that_is_none_is_refused(tmp_path):
    (tmp_path / "press.zip").write_bytes(b"no archive")
    with pytest.raises(InvalidQuantity, match=r"press\.zip, but must be a readable \.zip"):
        read_recording(tmp_path / "press.zip")


def test_a_zip_of_several_recordings_is_refused_with_how_many(folder, tmp_path):
    """The first one alone would be answered, and nobody told."""
    path = tmp_path / "three.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for number in range(3):
            for file in (one for one in folder.rglob("*") if one.is_file()):
                archive.write(file, f"press{number}/{file.relative_to(folder)}")
    for read in (read_recording, read_head, read_forces, read_picture):
        with pytest.raises(
            InvalidQuantity, match=r"three\.zip with 3 recordings in it, but must be one: unpack it and"
        ):
            read(path)


def test_an_export_of_recordings_is_refused_with_where_they_lie(folder, tmp_path):
    path = tmp_path / "recordings.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.write(zipped(folder), "recordings/a.zip")
        archive.writestr("measurements.csv", "")
    with pytest.raises(InvalidQuantity, match=r"unpack it and name what is in recordings/"):
        read_recording(path)


def test_what_a_mac_adds_to_a_zip_is_no_recording(folder):
    path = folder.with_suffix(".zip")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("__MACOSX/press/._recording.json", b"\0\5\x16\7")
        for file in (one for one in folder.rglob("*") if one.is_file()):
            archive.write(file, f"press/{file.relative_to(folder)}")
    assert read_recording(path).id == read_recording(folder).id


@pytest.mark.parametrize(("file", "quantity"), [("recording.json", "recording"), ("frames/002.png", "frames[2].file")])
def test_a_zip_with_a_damaged_file_is_refused(folder, file, quantity):
    path = zipped(folder)
    with zipfile.ZipFile(path) as archive:
        begin = archive.getinfo(file).header_offset + 30 + len(file)
    content = bytearray(path.read_bytes())
    content[begin + 20 : begin + 40] = bytes(20)
    path.write_bytes(content)
    with pytest.raises(InvalidQuantity) as refusal:
        read_recording(path)
    assert refusal.value.quantity == quantity


def fail_at(call):
    """Return a stand-in for the durable file that fails at the end of its n-th block, as a full disk does."""
    calls = []

    @contextmanager
    def opened(path):
        calls.append(path)
        with synced_file(path) as file:
            yield file
            if len(calls) == call:
                raise OSError(28, "No space left on device")

    return opened


@pytest.mark.parametrize("call", [1, 3, 5])
def test_a_failing_disk_leaves_nothing_half_written(tmp_path, call):
    """The first frame, a later one, and the description after all four frames."""
    with pytest.raises(OSError, match="No space left"):
        write_recording(small_recording(), tmp_path / "press", opened=fail_at(call))
    assert list(tmp_path.iterdir()) == []


def test_a_failing_disk_leaves_no_half_zip(tmp_path):
    with pytest.raises(OSError, match="No space left"):
        write_recording(small_recording(), tmp_path / "press.zip", opened=fail_at(1))
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_fills_up_in_the_middle_of_a_zip_leaves_nothing(tmp_path):
    """The kernel's own "no space left", with more than any buffer holds."""
    noise = np.random.default_rng(1).integers(0, 256, (600, 800), np.uint8)
    camera = replace(CAMERA, width_px=800, height_px=600)
    large = replace(small_recording(), camera=camera, frames=(Frame(noise, "press", 0.0, 0.5, (0.6,) * 4),) * 3)
    with pytest.raises(OSError, match="No space left"):
        write_recording(large, tmp_path / "press.zip", opened=lambda path: synced_file(Path("/dev/full")))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("bits", [8, 16])
def test_a_zip_comes_back_as_it_was_written_and_is_one_file(tmp_path, bits):
    write_recording(small_recording(bits), tmp_path / "press.zip")
    assert_same(read_recording(tmp_path / "press.zip"), small_recording(bits))
    assert [path.name for path in tmp_path.iterdir()] == ["press.zip"]


def test_a_zip_holds_the_folder_of_the_contract_uncompressed_and_unpacks_to_it(tmp_path):
    write_recording(small_recording(), tmp_path / "press.zip")
    write_recording(small_recording(), tmp_path / "folder")
    subprocess.run([sys.executable, "-m", "zipfile", "-e", "press.zip", "."], cwd=tmp_path, check=True)
    files = {
        str(path.relative_to(tmp_path / "folder")): path.read_bytes() for path in (tmp_path / "folder").rglob("*.*")
    }
    assert files == {
        str(path.relative_to(tmp_path / "press")): path.read_bytes() for path in (tmp_path / "press").rglob("*.*")
    }
    with zipfile.ZipFile(tmp_path / "press.zip") as archive:
        assert {one.compress_type for one in archive.infolist()} == {zipfile.ZIP_STORED}
        assert {one.external_attr >> 16 for one in archive.infolist()} == {0o644}


def test_the_clock_of_a_probe_may_be_wrong_and_the_same_recording_is_the_same_bytes(tmp_path, monkeypatch):
    write_recording(small_recording(), tmp_path / "now" / "press.zip")
    monkeypatch.setattr(time, "time", lambda: 0.0)  # 1970, which a .zip cannot say
    write_recording(small_recording(), tmp_path / "then" / "press.zip")
    assert (tmp_path / "now/press.zip").read_bytes() == (tmp_path / "then/press.zip").read_bytes()


@pytest.mark.parametrize("name", ["press", "press.zip"])
def test_a_picture_lies_in_a_recording_or_there_is_none(tmp_path, name):
    write_recording(small_recording(), tmp_path / "with" / name, picture=b"picture")
    write_recording(small_recording(), tmp_path / "without" / name)
    assert read_picture(tmp_path / "with" / name) == b"picture"
    assert read_picture(tmp_path / "without" / name) is None
    assert_same(read_recording(tmp_path / "with" / name), small_recording())


def test_a_damaged_picture_is_refused(tmp_path):
    path = tmp_path / "press.zip"
    write_recording(small_recording(), path, picture=b"a picture that is damaged")
    path.write_bytes(path.read_bytes().replace(b"that is damaged", b"that is mangled"))
    with pytest.raises(InvalidQuantity, match=r"image\.png is .*press\.zip, but must be a readable picture"):
        read_picture(path)


def test_frames_are_encoded_by_what_was_asked_for(tmp_path):
    asked = []
    write_recording(
        small_recording(), tmp_path / "press.zip", encode=lambda frame: asked.append(frame) or png_of(frame)
    )
    assert [frame.role for frame in asked] == list(ROLES)
    assert_same(read_recording(tmp_path / "press.zip"), small_recording())


def test_what_an_earlier_crash_left_behind_does_not_get_into_the_recording(tmp_path):
    stale = tmp_path / "press.tmp" / "frames"
    stale.mkdir(parents=True)
    (stale / "099.png").write_bytes(b"stale")
    write_recording(small_recording(), tmp_path / "press")
    assert not (tmp_path / "press" / "frames" / "099.png").exists()
    assert_same(read_recording(tmp_path / "press"), small_recording())


def test_a_recording_is_never_written_over(folder):
    with pytest.raises(OSError, match="not empty"):
        write_recording(replace(small_recording(), serial="another"), folder)
    assert_same(read_recording(folder), small_recording())


def test_a_zip_is_never_written_over(tmp_path):
    write_recording(small_recording(), tmp_path / "press.zip")
    with pytest.raises(FileExistsError):
        write_recording(replace(small_recording(), serial="another"), tmp_path / "press.zip")
    assert_same(read_recording(tmp_path / "press.zip"), small_recording())
    assert [path.name for path in tmp_path.iterdir()] == ["press.zip"]


def test_a_recording_of_a_hundred_thousand_frames_is_refused_before_any_is_read(folder):
    """Each entry names the one frame that is there: read, they would take some gigabytes."""
    path = folder / "recording.json"
    record = json.loads(path.read_text())
    record["frames"] = record["frames"][:1] * 100_000
    record["camera"] |= {"width_px": 640, "height_px": 480, "bits": 8}
    path.write_text(json.dumps(record))
    for png in (folder / "frames").iterdir():
        png.unlink()
    most = (1 << 30) // (640 * 480)
    with pytest.raises(InvalidQuantity, match=f"^frames of the recording is 100000, .* at most {most} frames"):
        read_recording(folder)


@pytest.mark.parametrize("name", ["press", "press.zip"])
def test_the_forces_are_read_without_a_frame(tmp_path, monkeypatch, name):
    written = small_recording()
    write_recording(written, tmp_path / name)
    monkeypatch.setattr(cv2, "imdecode", None)
    told = [(one.role, one.ramp, one.t_s, one.force_n) for one in read_forces(tmp_path / name)]
    assert told == [(one.role, one.ramp, one.t_s, one.force_n) for one in written.frames]


def test_forces_that_are_none_are_refused_by_their_name(tmp_path):
    (tmp_path / "recording.json").write_text('{"frames": [{"role": "press", "t_s": 0.1, "force_n": "0.5"}]}')
    with pytest.raises(InvalidQuantity, match=r"frames\[0\]\.force_n"):
        read_forces(tmp_path)
