"""A file that is no release of this product is told from its first bytes, in whatever parts they come."""

import io
import json
import tarfile

import pytest

from device.errors import InvalidRequest
from device.records.release_head import LONGEST_MANIFEST_BYTES, ReleaseHead


def tar(name="manifest.json", content=b'{"product": "tsis"}', kind=tarfile.REGTYPE):
    member, file = tarfile.TarInfo(name), io.BytesIO()
    member.size, member.type = len(content) if kind == tarfile.REGTYPE else 0, kind
    with tarfile.open(fileobj=file, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        archive.addfile(member, io.BytesIO(content))
    return file.getvalue()


def seen(content, part_bytes=10_000_000):
    head = ReleaseHead()
    for begin in range(0, len(content), part_bytes):
        head.see(content[begin : begin + part_bytes])
    head.require_complete()
    return head


@pytest.mark.parametrize("part_bytes", [1, 511, 512, 513, 10_000_000])
def test_a_release_of_this_product_is_taken_in_parts_of_any_size(part_bytes):
    manifest = json.dumps({"product": "tsis", "files": ["x" * 700]}).encode()
    assert seen(tar(content=manifest), part_bytes).is_complete


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\x00" * 4096, "no tar archive"),
        (b"PK\x03\x04" + b"x" * 4096, "no tar archive"),
        (tar("holiday.jpg"), "begins with 'holiday.jpg'"),
        (tar(kind=tarfile.SYMTYPE), "begins with"),
        (tar(content=b""), "0 bytes"),
        (tar(content=b"{" * 10), "no JSON"),
        (tar(content=b"[" * 200_000), "no JSON"),
        (tar(content=b"[]"), "not of this product"),
        (tar(content=b'{"product": "toaster"}'), "'toaster'"),
        (tar(content=b" " * (LONGEST_MANIFEST_BYTES + 1)), "bytes, but must have"),
        (b"", "too short"),
        (tar()[:511], "too short"),
        (tar()[:520], "too short"),
    ],
)
def test_anything_else_is_refused_in_words(content, words):
    with pytest.raises(InvalidRequest, match=words):
        seen(content)


def test_a_refusal_needs_no_more_than_the_first_block():
    with pytest.raises(InvalidRequest):
        ReleaseHead().see(tar("holiday.jpg")[:512])
