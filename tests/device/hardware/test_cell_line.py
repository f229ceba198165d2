"""A byte stream becomes lines, however it is cut and whatever it holds."""

import tracemalloc
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from device.hardware.cell_line import LineBuffer


@given(
    lines=st.lists(st.binary(max_size=20).filter(lambda data: b"\n" not in data), max_size=8),
    cuts=st.lists(st.integers(0, 200), max_size=8),
)
def test_lines_do_not_depend_on_how_the_stream_was_cut(lines, cuts):
    stream = b"".join(line + b"\n" for line in lines)
    edges = [0, *sorted(min(cut, len(stream)) for cut in cuts), len(stream)]
    buffer = LineBuffer(max_bytes=10)
    pieces = [stream[start:end] for start, end in pairwise(edges)]
    fed = [line for piece in pieces for line in buffer.feed(piece)]
    assert fed == [line for line in lines if len(line) <= 10]
    assert buffer.dropped_lines == len(lines) - len(fed)


def test_a_stream_without_line_ends_does_not_grow_in_memory():
    """1 MB of noise into a buffer of 256 bytes."""
    buffer = LineBuffer()
    tracemalloc.start()
    for _ in range(1000):
        buffer.feed(bytes(1000))
    _now_bytes, peak_bytes = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak_bytes < 50_000
