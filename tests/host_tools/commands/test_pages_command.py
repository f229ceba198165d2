"""`host_tools pages`: pages are written from what was measured, and `--check` tells which are not."""

import shutil

import pytest
from typer.testing import CliRunner

from host_tools.__main__ import app
from host_tools.pages import page


@pytest.fixture
def docs(tmp_path, monkeypatch):
    """A folder of docs with one page's results and no page."""
    (tmp_path / "results").mkdir()
    shutil.copy(page.RESULTS / "optics.json", tmp_path / "results")
    monkeypatch.setattr(page, "DOCS", tmp_path)
    monkeypatch.setattr(page, "RESULTS", tmp_path / "results")
    return tmp_path


def pages(*words):
    return CliRunner().invoke(app, ["pages", *words])


def test_a_page_is_written_from_results_and_template(docs):
    done = pages()
    assert done.exit_code == 0
    assert "optics.md written." in done.output
    assert (docs / "optics.md").read_text().startswith("# The light")
    assert pages("--check").exit_code == 0


def test_check_writes_nothing_and_names_the_page_that_is_edited_by_hand(docs):
    pages()
    edited = (docs / "optics.md").read_text().replace("grazing", "steep")
    (docs / "optics.md").write_text(edited)
    done = pages("--check")
    assert done.exit_code == 1
    assert "optics.md: not what results and template say" in done.output
    assert (docs / "optics.md").read_text() == edited
