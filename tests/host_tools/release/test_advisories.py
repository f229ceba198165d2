"""Parts of real releases beside advisories as osv.dev has them, shortened; versions and ranges are theirs."""

import json
import tarfile
import zipfile
from io import BytesIO

import pytest
from small_wheels import small_wheel
from toolkit_process import run_toolkit

from device.measurement.quantities import InvalidQuantity
from host_tools.release.advisories import ListedWheel, compared, parts_of
from host_tools.release.checkout import Checkout
from host_tools.release.parts_list import parts_list
from host_tools.release.target import Target


def advisory(name, number, *events, versions=(), summary="", **others):
    """Return an advisory of a wheel; `events` are those of a range of versions."""
    ranges = [
        {"type": "GIT", "events": [{"introduced": "0"}, {"fixed": "43a9c9bfa6aa626ec2a22540bea28d2ca77964be"}]},
        {"type": "ECOSYSTEM", "events": list(events)},
    ]
    affected = {"package": {"name": name, "ecosystem": "PyPI"}, "ranges": ranges, "versions": list(versions)}
    record = {"id": number, "modified": "2023-05-04T04:29:29Z", "affected": [affected], "summary": summary}
    return record | others


SETUPTOOLS = advisory(
    "setuptools",
    "PYSEC-2022-43012",
    {"introduced": "0"},
    {"fixed": "65.5.1"},
    summary="Denial of service by HTML in a crafted package",
    aliases=["CVE-2022-40897"],
)
JINJA = advisory(
    "Jinja2", "PYSEC-2019-217", {"introduced": "0"}, {"fixed": "2.10.1"}, versions=["2.0rc1", "2.10", "not one"]
)


@pytest.fixture
def database(tmp_path):
    """A function that writes a folder of advisories."""

    def written(*records):
        folder = tmp_path / "advisories"
        folder.mkdir(exist_ok=True)
        for record in records:
            (folder / f"{record['id']}.json").write_text(json.dumps(record))
        return folder

    return written


def found(folder, name, version):
    return [one.names[0] for one in compared([ListedWheel(name, version)], folder).found]


@pytest.mark.parametrize(
    ("name", "version", "numbers"),
    [
        ("setuptools", "65.5.0", ["PYSEC-2022-43012"]),
        ("setuptools", "65.5.1", []),
        ("setuptools", "65.5.1rc1", ["PYSEC-2022-43012"]),
        ("jinja2", "2.10", ["PYSEC-2019-217"]),
        ("jinja2", "2.10.0", ["PYSEC-2019-217"]),
        ("jinja2", "3.1.6", []),
        ("numpy", "1.0", []),
    ],
)
def test_a_version_is_affected_before_the_one_that_mends_it(database, name, version, numbers):
    assert found(database(SETUPTOOLS, JINJA), name, version) == numbers


@pytest.mark.parametrize(
    ("version", "is_affected"),
    [("0.9", False), ("1.0", True), ("1.4", False), ("2.5", True), ("3.0", True), ("3.1", False)],
)
def test_two_ranges_of_versions_are_two_ranges_in_whatever_order(database, version, is_affected):
    events = [{"last_affected": "3.0"}, {"introduced": "2.0"}, {"fixed": "1.4"}, {"introduced": "1.0"}]
    assert found(database(advisory("part", "X-1", *events)), "part", version) == ["X-1"] * is_affected


def test_what_was_withdrawn_or_is_of_another_ecosystem_counts_for_nothing(database):
    withdrawn = SETUPTOOLS | {"id": "X-1", "withdrawn": "2024-01-01T00:00:00Z"}
    other = advisory("setuptools", "X-2", {"introduced": "0"})
    other["affected"][0]["package"]["ecosystem"] = "npm"
    comparison = compared([ListedWheel("setuptools", "65.5.0")], database(withdrawn, other, JINJA))
    assert (comparison.advisories, comparison.found) == (1, ())


@pytest.mark.parametrize("kind", ["none", "damaged", "of another form", "no zip"])
def test_a_database_that_cannot_tell_is_refused_instead_of_knowing_nothing(database, tmp_path, kind):
    folder = database()
    match kind:
        case "damaged":
            (folder / "one.json").write_text('{"id": ')
        case "of another form":
            (folder / "one.json").write_text('{"affected": [{"name": "setuptools"}]}')
        case "no zip":
            folder = tmp_path / "all.zip"
            folder.write_bytes(b"PK")
    with pytest.raises(InvalidQuantity, match=r"fetch all\.zip of PyPI from osv\.dev"):
        compared([ListedWheel("setuptools", "65.5.0")], folder)


@pytest.fixture
def release(tmp_path):
    """A release file with the parts list of two wheels."""
    own = small_wheel(tmp_path, "tsis", metadata="Requires-Dist: jinja2\nRequires-Dist: setuptools\n")
    others = [small_wheel(tmp_path, "setuptools", "65.5.0"), small_wheel(tmp_path, "jinja2", "3.1.6")]
    checkout = Checkout(tmp_path, "0123456789abcdef", 1_700_000_000, ())
    listed = parts_list(own, others, checkout, Target.named("aarch64"))
    with tarfile.open(tmp_path / "one.release", "w") as archive:
        member = tarfile.TarInfo("sbom.json")
        member.size = len(listed)
        archive.addfile(member, BytesIO(listed))
    (tmp_path / "sbom.json").write_bytes(listed)
    return tmp_path / "one.release"


def test_the_command_names_the_wheel_the_advisory_and_the_version_that_mends(release, database, tmp_path):
    with zipfile.ZipFile(tmp_path / "all.zip", "w") as archive:
        for record in (SETUPTOOLS, JINJA):
            archive.writestr(f"{record['id']}.json", json.dumps(record))
    done = run_toolkit("release", "advisories", release, "--database", tmp_path / "all.zip")
    assert done.returncode == 1
    assert done.stdout.splitlines() == [
        "setuptools 65.5.0: PYSEC-2022-43012 CVE-2022-40897, mended in 65.5.1: "
        "Denial of service by HTML in a crafted package",
        "2 parts, 2 advisories as of 2023-05-04T04:29:29Z: 1 known vulnerabilities",
    ]
    clean = run_toolkit("release", "advisories", release.with_name("sbom.json"), "--database", database(JINJA))
    assert (clean.returncode, clean.stdout.split(": ")[1]) == (0, "no known vulnerability\n")


def test_a_file_without_parts_is_refused(tmp_path):
    (tmp_path / "empty.json").write_text('{"components": []}')
    (tmp_path / "text").write_text("no parts list")
    for name in ("empty.json", "text"):
        with pytest.raises(InvalidQuantity, match="build one: make bundle"):
            parts_of(tmp_path / name)
