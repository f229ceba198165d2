"""The screen in three answers: each file of the page once, in an order in which nothing is used before it is there."""

from __future__ import annotations

import asyncio
import re
import shutil
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI

from device.web.screen.joined_files import MODULES_AT, SHEETS_AT, STATIC, add_screen, joined_screen
from device.web.screen.kept_choices import KeptChoices
from device.web.screen.screen_words import LANGUAGES

SCREEN = joined_screen()


def ask(path: str, **headers: str) -> httpx.Response:
    """Ask an application that has the screen alone."""
    app = FastAPI()
    add_screen(app, KeptChoices())

    async def answer() -> httpx.Response:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
            return await client.get(path, headers=headers)

    return asyncio.run(answer())


def folder_with(folder: Path, **modules: str) -> Path:
    """Return a folder of a page whose first module is `screen`."""
    shutil.copy(STATIC / "index.html", folder / "index.html")
    for path in STATIC.rglob("*.css"):
        (folder / path.relative_to(STATIC)).parent.mkdir(exist_ok=True)
        shutil.copy(path, folder / path.relative_to(STATIC))
    for name, text in modules.items():
        (folder / f"{name}.js").write_text(text)
    return folder


def test_the_page_asks_for_two_joined_files_and_its_words_only() -> None:
    asked = re.findall(r'(?:href|src)="(/static/[^"]+)"', SCREEN.page)
    assert asked == [f"/static/words/{name}.json" for name in ("sentences", *LANGUAGES)] + [SHEETS_AT, MODULES_AT]


def test_every_style_sheet_and_every_module_of_the_page_is_there_once() -> None:
    page = (STATIC / "index.html").read_text(encoding="utf-8")
    for name in re.findall(r'rel="stylesheet" href="/static/([^"]+)"', page):
        assert SCREEN.sheets.count((STATIC / name).read_text(encoding="utf-8")) == 1
    named = {*re.findall(r'rel="modulepreload" href="/static/([^"]+)"', page), "screen.js"}
    titles = re.findall(r"^// (\S+\.js)$", SCREEN.modules, re.MULTILINE)
    assert sorted(titles) == sorted(named)


def test_what_is_imported_stands_above_and_nothing_is_left_to_import() -> None:
    made: set[str] = set()
    for line in SCREEN.modules.splitlines():
        if used := re.fullmatch(r"const \{ .+ \} = (module_\d+);", line):
            assert used[1] in made
        if begun := re.fullmatch(r"const (module_\d+) = await \(async \(\) => \{", line):
            name = begun[1]
        if line == "})();":
            made.add(name)
    assert len(made) > 30
    assert not re.search(r"^(import|export)\b", SCREEN.modules, re.MULTILINE)


def test_a_name_that_is_imported_as_another_is_taken_so(tmp_path: Path) -> None:
    ours = folder_with(
        tmp_path, screen='import { a as b } from "./other.js";\nb();\n', other="export const a = () => 1;\n"
    )
    assert "const { a: b } = module_0;" in joined_screen(ours).modules


@pytest.mark.parametrize(
    "text", ['import {\n  a,\n} from "./other.js";\n', "export default 1;\n", 'import "./other.js";\n']
)
def test_a_module_that_cannot_be_joined_is_told_by_its_name(text: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"screen\.js: .* cannot be joined"):
        joined_screen(folder_with(tmp_path, screen=text, other="export const a = 1;\n"))


def test_modules_that_import_each_other_are_told_by_their_names(tmp_path: Path) -> None:
    circle = {"screen": 'import { a } from "./other.js";\n', "other": 'import { b } from "./third.js";\n'}
    circle["third"] = 'import { a } from "./other.js";\nexport const b = a;\n'
    with pytest.raises(ValueError, match=r"other\.js -> third\.js -> other\.js: modules that import each other"):
        joined_screen(folder_with(tmp_path, **circle))


@pytest.mark.parametrize(("path", "kind"), [(SHEETS_AT, "text/css"), (MODULES_AT, "text/javascript")])
def test_what_a_browser_has_is_not_sent_again(path: str, kind: str) -> None:
    first = ask(path)
    assert first.headers["content-type"].startswith(kind)
    again = ask(path, **{"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
