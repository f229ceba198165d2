"""What is refused changes nothing: every path below the root stays as it was, and the reason is told."""

import io
import json
import os
import random
import stat
import tarfile
import zipfile

import pytest
from small_release import manifest, plain, release_file, signature, signer, small_files, tar, wheel

from device.errors import DeviceError, UnfitRelease, UntrustedRelease
from device.update.__main__ import main
from device.update.install import install
from device.update.progress import ProgressReport
from device.update.trial import Updater


@pytest.fixture
def refused(probe, monkeypatch):
    """Return what refuses a release file, after it has looked whether anything was changed."""

    def refusal(content, kind=DeviceError):
        path, before = probe.keep(content), probe.snapshot()
        report = ProgressReport(probe.layout)
        with pytest.raises(kind) as error:
            install(Updater(probe.layout, report), path)
        assert probe.snapshot() == before
        assert (probe.progress.state, probe.progress.code) == ("refused", error.value.code)
        assert probe.progress.reason == str(error.value)
        return error.value

    return refusal


@pytest.mark.parametrize("option", ["--health-within", "--look-every"])
@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "inf", "soon"])
def test_a_time_that_is_none_is_refused_before_anything_is_switched(option, seconds, capsys):
    with pytest.raises(SystemExit, match="2"):
        main([f"{option}={seconds}", "status"])
    assert f"{seconds!r} is no time: give seconds above 0" in capsys.readouterr().err


@pytest.fixture
def good(keys):
    return release_file(keys["good"], "1.0", 10)


def members(content):
    """Return where each header of a tar begins, and where the last content ends."""
    with tarfile.open(fileobj=io.BytesIO(content)) as archive:
        found = list(archive)
    return [member.offset for member in found], found[-1].offset_data + found[-1].size


def places(content):
    """Return one byte of every field of every header, some of every content, the padding and the end."""
    starts, end = members(content)
    fields = [0, 99, 100, 105, 108, 116, 124, 134, 136, 148, 153, 154, 155, 156, 157, 257, 263, 265, 297, 345, 500, 511]
    inside = [start + 512 + step for start in starts for step in (0, 1, 7, 60, 200, 300)]
    rest = [end, end + 1, len(content) - 10240, len(content) - 512, len(content) - 1]
    drawn = random.Random(5).sample(range(len(content)), 60)
    return sorted({start + field for start in starts for field in fields} | set(inside) | set(rest) | set(drawn))


def test_a_flipped_byte_is_refused_wherever_it_is(refused, good):
    for number, place in enumerate(places(good)):
        flipped = bytearray(good)
        flipped[place] ^= (1, 16, 32, 128)[number % 4]
        error = refused(bytes(flipped), UntrustedRelease)
        assert error.code == "E010", place


def test_every_byte_of_the_signature_counts(refused, good):
    """Also those by which an armour can say the same in other bytes: line ends, and bits that base 64 leaves over."""
    starts, _ = members(good)
    size = good[starts[1] : starts[2]].rstrip(b"\0").rindex(b"\n") + 1
    for place in range(starts[1] + 512, starts[1] + size):
        flipped = bytearray(good)
        flipped[place] ^= 4
        refused(bytes(flipped), UntrustedRelease)


def test_a_copy_that_was_interrupted_is_refused_at_whatever_byte(refused, good):
    starts, end = members(good)
    drawn = random.Random(7).sample(range(len(good)), 40)
    edges = {place + step for place in (*starts, end, len(good)) for step in (-513, -512, -1, 0, 1, 511, 512)}
    for length in sorted({place for place in (*edges, *drawn) if 0 <= place < len(good)}):
        error = refused(good[:length], UntrustedRelease)
        assert error.cause.startswith(f"The release file ends after {length} bytes, inside "), length


def test_what_is_appended_is_refused(refused, good):
    for more in (b"\0", b"\0" * 10240, b"more"):
        assert "more than its manifest lists" in refused(good + more, UntrustedRelease).cause


@pytest.mark.parametrize("content", [b"", b"PK\3\4 a zip", b"\0" * 20480])
def test_what_is_no_release_file_is_refused(refused, content):
    refused(content, UntrustedRelease)


def test_a_key_that_the_probe_does_not_know_is_refused(refused, keys):
    assert "not signed by a key that this probe trusts" in refused(release_file(keys["evil"], "1.0", 10)).cause


def test_a_signature_for_another_purpose_is_refused(refused, keys):
    files = small_files("1.0")
    signed = manifest(files, "1.0", 10)
    for_mail = signature(signed, keys["good"], namespace="file")
    error = refused(tar({"manifest.json": signed, "manifest.json.sig": for_mail, **files}), UntrustedRelease)
    assert "not signed by a key that this probe trusts" in error.cause


def test_a_key_of_another_identity_signs_no_release(refused, probe, keys, good):
    probe.layout.signers.write_text(signer(keys["good"], "somebody@tsis"))
    assert "release@tsis" in refused(good, UntrustedRelease).cause


@pytest.mark.parametrize("text", [None, "", "# nobody\n", "release@tsis ssh-ed25519 no-key\n", "release@tsis\n"])
def test_a_probe_that_trusts_nobody_installs_nothing(refused, probe, good, text):
    probe.layout.signers.unlink()
    if text is not None:
        probe.layout.signers.write_text(text)
    assert refused(good, UntrustedRelease).cause.startswith("This probe cannot say whom it trusts")


def test_a_key_with_a_date_is_refused_for_no_clock_can_keep_it(refused, probe, keys, good):
    probe.layout.signers.write_text(signer(keys["good"]).replace(" ", ' valid-after="20200101" ', 1))
    assert "has a date, which the probe's clock cannot keep" in refused(good, UntrustedRelease).cause


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"product": "other"}, "for product other, and this probe has tsis"),
        ({"machine": "vax"}, "for machine vax, and this probe has"),
        ({"python": "2.7"}, "for Python 2.7, and this probe has"),
        ({"hardware": ["tsis-probe-9"]}, "for tsis-probe-9, and this probe is tsis-probe-1"),
        ({"hardware": []}, "for none, and this probe"),
        ({"schema": "tsis.release/2"}, "schema 'tsis.release/2', and this probe reads tsis.release/1"),
        ({"signers": "release@tsis nonsense"}, "would change whom this probe trusts"),
        ({"counter": 0}, "counter 0, and one of 0 was already in use"),
    ],
)
def test_what_is_not_for_this_probe_is_refused(refused, keys, changes, reason):
    error = refused(release_file(keys["good"], "1.0", **({"counter": 10} | changes)), UnfitRelease)
    assert error.code == "E011"
    assert reason in error.cause


@pytest.mark.parametrize("counter", [9, 10])
def test_an_older_counter_is_refused_also_of_a_higher_version(probe, refused, keys, counter):
    probe.install("1.0", 10)
    assert (
        f"counter {counter}, and one of 10" in refused(release_file(keys["good"], "2.0", counter), UnfitRelease).cause
    )
    assert probe.require_whole() == "1.0+10"


def test_a_release_that_failed_is_not_tried_again_and_the_next_counter_is(probe, refused, keys):
    probe.install("1.0", 10)
    probe.run("install", probe.write("1.1", 11, {"dies_after": 1}))
    assert "1.1+11 was tried and failed: It was ready" in refused(release_file(keys["good"], "1.1", 11)).cause
    probe.install("1.1", 12)
    assert probe.state.bad == {}


@pytest.mark.parametrize(
    "changes",
    [
        {"version": "../../etc"}, {"version": "1.0/2"}, {"version": ""}, {"version": 1}, {"counter": -1},
        {"counter": True}, {"counter": 1.5}, {"counter": "10"}, {"files": []}, {"files": [{}]}, {"files": None},
        {"data_schemas": {}}, {"data_schemas": {"store": {"writes": "1", "reads": [1]}}}, {"hardware": None},
        {"signers": None}, {"product": None},
    ],
)  # fmt: skip
def test_a_malformed_manifest_is_refused_though_it_is_signed(refused, keys, changes):
    content = release_file(keys["good"], **({"version": "1.0", "counter": 10} | changes))
    assert refused(content, UntrustedRelease).cause.startswith("The release's manifest is malformed")


@pytest.mark.parametrize("text", [b"", b"[]", b"{", b'{"schema": 1, "schema": 2}', b"[" * 100_000, b"\xff"])
def test_a_manifest_that_is_none_is_refused_though_it_is_signed(refused, keys, text):
    refused(tar({"manifest.json": text, "manifest.json.sig": signature(text, keys["good"])}))


@pytest.mark.parametrize(
    "path",
    ["/etc/passwd", "../escape", "wheels/../../x.whl", "wheels/a/b.whl", "systemd/../x", "bin/sh", "systemd/.hidden",
     "wheels/\u00e9.whl", "systemd/a/b/c/d"],
)  # fmt: skip
def test_a_file_that_leads_out_of_its_place_is_refused_though_it_is_signed(refused, keys, path):
    files = small_files("1.0") | {path: b"x"}
    assert "path is" in refused(release_file(keys["good"], "1.0", 10, content=files), UntrustedRelease).cause


def test_a_file_that_is_listed_twice_is_refused(refused, keys):
    files = small_files("1.0")
    listed = json.loads(manifest(files, "1.0", 10))["files"]
    content = release_file(keys["good"], "1.0", 10, content=files, files=[*listed, listed[0]])
    assert "listed twice" in refused(content, UntrustedRelease).cause


@pytest.mark.parametrize("kind", [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.DIRTYPE, tarfile.CHRTYPE, tarfile.FIFOTYPE])
def test_a_member_of_the_tar_that_is_no_file_is_refused(refused, keys, kind):
    files = small_files("1.0")
    signed = manifest(files, "1.0", 10)
    made = [plain(member) for member in {"manifest.json": signed, "sig": b""}.items()]
    made[1] = plain(("manifest.json.sig", signature(signed, keys["good"])))
    made += [plain(member) for member in files.items()]
    link = tarfile.TarInfo("wheels/number-2.0-py3-none-any.whl")
    link.type, link.linkname = kind, "/etc/passwd"
    made[2] = (link, b"")
    refused(tar(made), UntrustedRelease)


def test_members_in_another_order_twice_or_beside_the_list_are_refused(refused, keys):
    files = small_files("1.0")
    signed = manifest(files, "1.0", 10)
    first = [plain(("manifest.json", signed)), plain(("manifest.json.sig", signature(signed, keys["good"])))]
    rest = [plain(member) for member in files.items()]
    for made in (first + rest[::-1], [*first, rest[0], *rest], first[::-1] + rest, first + rest[1:], first):
        refused(tar(made), UntrustedRelease)
    for more in (plain(("extra", b"x")), rest[0]):
        assert "more than its manifest lists" in refused(tar(first + rest + [more]), UntrustedRelease).cause


def test_a_header_that_asks_for_more_than_there_may_be_is_refused_before_it_is_read(refused):
    huge = tarfile.TarInfo("manifest.json")
    huge.size = 8 * 2**30 - 1
    header = huge.tobuf(tarfile.USTAR_FORMAT)
    assert "may have at most 1048576" in refused(header + b"\0" * 20480, UntrustedRelease).cause


def own_wheel(files):
    return {"wheels/tsis-1.0-py3-none-any.whl": wheel(files)}


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("../escape.py", "leads out of its place"),
        ("/etc/cron.d/evil", "leads out of its place"),
        ("a/../../escape.py", "leads out of its place"),
        ("a//b.py", "leads out of its place"),
        ("a\\..\\b.py", "leads out of its place"),
        ("tsis-1.0.data/purelib/../../x.py", "leads out of its place"),
        ("tsis-1.0.data/purelib", "has no place"),
    ],
)
def test_a_wheel_whose_member_leads_out_is_refused_though_it_is_signed(refused, keys, name, reason):
    content = release_file(keys["good"], "1.0", 10, content=own_wheel({name: "x"}))
    assert reason in refused(content, UntrustedRelease).cause


@pytest.mark.parametrize("kind", [stat.S_IFLNK, stat.S_IFCHR, stat.S_IFIFO, stat.S_IFSOCK])
def test_a_wheel_with_a_link_or_a_device_is_refused_though_it_is_signed(refused, keys, kind):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        member = zipfile.ZipInfo("tsis/link")
        member.external_attr = (kind | 0o777) << 16
        archive.writestr(member, "/etc/passwd")
    files = {"wheels/tsis-1.0-py3-none-any.whl": packed.getvalue()}
    content = release_file(keys["good"], "1.0", 10, content=files)
    assert "is a link, a device or encrypted" in refused(content, UntrustedRelease).cause


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_wheel_that_brings_a_file_twice_or_below_a_file_is_refused(refused, keys):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("tsis/a.py", "1")
        archive.writestr("tsis/a.py", "2")
    twice = {"wheels/tsis-1.0-py3-none-any.whl": packed.getvalue()}
    assert "brings a file twice" in refused(release_file(keys["good"], "1.0", 10, content=twice)).cause
    merged = own_wheel({"a.py": "1", "tsis-1.0.data/purelib/a.py": "2"})
    assert "brings a file twice" in refused(release_file(keys["good"], "1.0", 10, content=merged)).cause
    below = own_wheel({"a": "1", "a/b": "2"})
    assert "lies in a file" in refused(release_file(keys["good"], "1.0", 10, content=below)).cause
    both = own_wheel({"a.py": "1"}) | {"wheels/other-1.0-py3-none-any.whl": wheel({"a.py": "1"})}
    assert "both bring a.py" in refused(release_file(keys["good"], "1.0", 10, content=both)).cause


def test_a_wheel_that_would_become_far_too_large_is_refused(refused, keys):
    content = release_file(keys["good"], "1.0", 10, content=own_wheel({"zeros.bin": b"\0" * 20_000_000}))
    assert "would become 20000000, above" in refused(content, UntrustedRelease).cause


def test_a_wheel_whose_directory_lies_about_a_size_is_refused_and_what_was_unpacked_is_gone(refused, keys):
    packed = bytearray(wheel({"tsis/a.bin": b"\0" * 5000}))
    for place in (packed.index(b"PK\3\4") + 22, packed.index(b"PK\1\2") + 24):
        packed[place : place + 4] = (100).to_bytes(4, "little")
    content = release_file(keys["good"], "1.0", 10, content={"wheels/tsis-1.0-py3-none-any.whl": bytes(packed)})
    assert "is damaged at tsis/a.bin" in refused(content, UntrustedRelease).cause


def test_what_is_no_wheel_is_refused(refused, keys):
    content = release_file(keys["good"], "1.0", 10, content={"wheels/tsis-1.0-py3-none-any.whl": b"no zip"})
    assert "is not a wheel" in refused(content, UntrustedRelease).cause


@pytest.mark.parametrize("there", ["missing", "folder", "link", "pipe"])
def test_what_is_no_file_is_refused(probe, tmp_path, there):
    path = tmp_path / "what.release"
    {
        "missing": lambda: None, "folder": path.mkdir, "link": lambda: path.symlink_to("/etc/passwd"),
        "pipe": lambda: os.mkfifo(path),
    }[there]()  # fmt: skip
    with pytest.raises(UntrustedRelease):
        install(Updater(probe.layout, ProgressReport(probe.layout)), path)
