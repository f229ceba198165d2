from pathlib import Path

import pytest
from small_wheels import locked, small_wheel

from device.measurement.quantities import InvalidQuantity
from host_tools.release.lock import read_lock
from host_tools.release.locked_wheels import locked_wheels, name_in_release
from host_tools.release.target import Target

ARM = Target.named("aarch64")


@pytest.fixture
def index(tmp_path, monkeypatch):
    """A folder of wheels that is all that pip knows."""
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path / "index"))
    (tmp_path / "index").mkdir()
    return tmp_path / "index"


def fetched(tmp_path, *lines):
    (tmp_path / "device.lock").write_text("".join(lines))
    told = []
    wheels = locked_wheels(read_lock(tmp_path / "device.lock"), ARM, tmp_path / "kept", told.append)
    assert [one.pinned for one in told] == [one.pinned for one in read_lock(tmp_path / "device.lock")]
    return wheels


def test_a_wheel_for_the_target_is_downloaded_once_and_kept(index, tmp_path):
    wheel = small_wheel(index, "some-thing", tag="cp311-cp311-manylinux_2_28_aarch64")
    small_wheel(index, "some-thing", tag="cp311-cp311-manylinux_2_28_x86_64")
    line = locked(wheel)
    assert [path.name for path in fetched(tmp_path, line)] == [wheel.name]
    wheel.unlink()
    (found,) = fetched(tmp_path, line)
    assert found == tmp_path / "kept" / wheel.name


def test_a_kept_wheel_that_is_not_the_locks_is_not_taken(index, tmp_path):
    wheel = small_wheel(index, "some-thing")
    line = locked(wheel)
    small_wheel(tmp_path / "kept", "some-thing", metadata="Summary: another one\n")
    assert fetched(tmp_path, line)[0].read_bytes() == wheel.read_bytes()


def test_a_requirement_without_a_wheel_for_the_target_is_named_with_what_was_looked_for(index, tmp_path):
    good = small_wheel(index, "some-thing")
    wheel = small_wheel(index, "another", tag="cp311-cp311-manylinux_2_28_x86_64")
    with pytest.raises(
        InvalidQuantity, match="another==1.0 is no wheel, but must be one for cp311-manylinux_2_36_aarch64"
    ) as no:
        fetched(tmp_path, locked(good), locked(wheel))
    assert "manylinux_2_36_aarch64, manylinux_2_35_aarch64" in str(no.value)
    assert "No matching distribution found for another==1.0" in str(no.value)


def test_a_wheel_with_another_hash_is_refused(index, tmp_path):
    line = locked(small_wheel(index, "some-thing"))
    small_wheel(index, "some-thing", metadata="Summary: changed since\n")
    with pytest.raises(InvalidQuantity, match="some-thing==1.0 is no wheel"):
        fetched(tmp_path, line)


def test_a_wheel_of_many_platforms_has_a_name_that_a_release_holds():
    """charset-normalizer's has 105 characters where a header holds 100; pip takes it by any of its platforms."""
    long = "charset_normalizer-3.5.2-cp311-cp311-manylinux2014_x86_64.manylinux_2_17_x86_64.manylinux_2_28_x86_64.whl"
    found = name_in_release(long)
    assert found == "charset_normalizer-3.5.2-cp311-cp311-manylinux2014_x86_64.whl"
    assert Target.named("x86_64").rank(Path(found)) is not None
    assert name_in_release("numpy-2.3.1-cp311-cp311-any.whl") == "numpy-2.3.1-cp311-cp311-any.whl"
