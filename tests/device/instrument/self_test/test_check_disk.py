"""A file is written, synchronised and read; a disk that is full, read-only or changes bytes fails."""

import errno
from contextlib import contextmanager

import pytest

from device.instrument.self_test.checks import disk_results
from device.records.disk import LocalDisk
from device.records.store import Store


class TroubledDisk(LocalDisk):
    """The real disk, with an error, a changed byte, or little space."""

    def __init__(self, number=None, is_forgetful=False, free_bytes=10**9):
        self.number, self.is_forgetful, self.left = number, is_forgetful, free_bytes

    def free_bytes(self, folder):
        return self.left

    @contextmanager
    def file(self, path):
        if self.number:
            raise OSError(self.number, "refused")
        with super().file(path) as file:
            yield file
            if self.is_forgetful:
                file.seek(file.tell() - 1)
                file.write(b"?")


@pytest.fixture
def judge(tmp_path):
    """Return the results on a disk by check; nothing of the test stays on it."""

    def judging(disk):
        store = Store(tmp_path, disk)
        before = sorted(tmp_path.iterdir())
        results = disk_results(store, 50.0)
        assert sorted(tmp_path.iterdir()) == before
        store.close()
        return {result.check: result for result in results}

    return judging


def test_a_sound_disk_gives_back_what_it_took(judge):
    results = judge(TroubledDisk())
    assert [result.verdict for result in results.values()] == ["passed", "passed"]
    assert results["free space"].value == 1000.0


@pytest.mark.parametrize(("number", "code"), [(errno.ENOSPC, "E602"), (errno.EROFS, "E601")])
def test_a_disk_that_takes_nothing_fails_with_the_code_of_why(judge, number, code):
    result = judge(TroubledDisk(number))["write and read"]
    assert (result.verdict, result.code) == ("failed", code)


def test_a_disk_that_changes_a_byte_fails(judge):
    result = judge(TroubledDisk(is_forgetful=True))["write and read"]
    assert (result.verdict, result.value, result.unit) == ("failed", 1.0, "bytes wrong")


def test_a_disk_with_too_little_space_fails_before_it_is_full(judge):
    results = judge(TroubledDisk(free_bytes=49_000_000))
    assert {check: result.verdict for check, result in results.items()} == {
        "free space": "failed",
        "write and read": "passed",
    }
