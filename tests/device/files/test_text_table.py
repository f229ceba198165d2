"""Rows as the commands print them."""

from device.files.text_table import aligned


def test_each_column_is_as_wide_as_its_widest_word_and_lines_end_without_blanks():
    assert list(aligned([("a", "long word", "x"), ("bcd", "", "")])) == ["a    long word  x", "bcd"]
