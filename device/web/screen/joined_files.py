"""The screen's style sheets as one answer and its modules as another, joined at the start from the files as they are.

A first visit would ask for some fifty files, and each request costs the probe's computer more than what it brings. The
page in the repository names every file and works without this. Joined, each module is a block of its own that gives
what it exports to those below it: the modules import each other by name and in no circle, and say so on one line each.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from fastapi import FastAPI, Request, Response

from device.access.scopes import PAIRING_PAGE
from device.web.conditional import answer_or_unchanged
from device.web.guard import asked
from device.web.screen.kept_choices import KeptChoices

STATIC = Path(__file__).parents[1] / "static"
SHEETS_AT, MODULES_AT = "/static/joined/screen.css", "/static/joined/screen.js"
FIRST_MODULE = "screen.js"
IMPORT = re.compile(r'^import \{ (.+) \} from "(\.[^"]+)";$', re.MULTILINE)
EXPORT = re.compile(r"^export ((?:async )?function|const) (\w+)", re.MULTILINE)
UNJOINED = re.compile(r"^(?:import|export)\b.*", re.MULTILINE)
SHEET = re.compile(r' *<link rel="stylesheet" href="/static/([^"]+)">\n')
MODULE = re.compile(r' *<(?:link rel="modulepreload" href|script type="module" src)="/static/[^"]+">(?:</script>)?\n')


@dataclass(frozen=True)
class JoinedScreen:
    """The page, its style sheets and its modules."""

    page: str
    sheets: str
    modules: str


@cache
def joined_screen(static: Path = STATIC) -> JoinedScreen:
    """Return the screen of a folder; raises `ValueError` for a module that cannot be joined, or a circle of them."""
    page = (static / "index.html").read_text(encoding="utf-8")
    sheets = [(static / name).read_text(encoding="utf-8") for name in SHEET.findall(page)]
    modules = _in_order(static / FIRST_MODULE, {})
    names = {path: f"module_{number}" for number, path in enumerate(modules)}
    blocks = [_block(path, names, path.relative_to(static.resolve())) for path in modules]
    page = MODULE.sub("", SHEET.sub("", page))
    asks = f'  <link rel="stylesheet" href="{SHEETS_AT}">\n  <script type="module" src="{MODULES_AT}"></script>\n'
    return JoinedScreen(page.replace("</head>", f"{asks}</head>", 1), "\n".join(sheets), "\n".join(blocks))


def _in_order(path: Path, known: dict[Path, None], above: tuple[Path, ...] = ()) -> list[Path]:
    """Return a module behind all that it imports; `above` are those that have led to it."""
    path = path.resolve()
    if path in above:
        circle = " -> ".join(one.name for one in (*above[above.index(path) :], path))
        raise ValueError(f"{circle}: modules that import each other in a circle cannot be joined: move what both need.")
    if path not in known:
        for _, other in IMPORT.findall(path.read_text(encoding="utf-8")):
            _in_order(path.parent / other, known, (*above, path))
        known[path] = None
    return list(known)


def _block(path: Path, names: dict[Path, str], title: Path) -> str:
    """Return a module as a block that is run in place and gives what it exports."""

    def taken(found: re.Match[str]) -> str:
        return f"const {{ {found[1].replace(' as ', ': ')} }} = {names[(path.parent / found[2]).resolve()]};"

    text = path.read_text(encoding="utf-8")
    exported = ", ".join(name for _, name in EXPORT.findall(text))
    text = EXPORT.sub(r"\1 \2", IMPORT.sub(taken, text))
    if left := UNJOINED.search(text):
        raise ValueError(f"{title}: `{left[0]}` cannot be joined: import names on one line, export what is declared.")
    return f"// {title}\nconst {names[path]} = await (async () => {{\n{text}\nreturn {{ {exported} }};\n}})();"


def add_screen(app: FastAPI, choices: KeptChoices) -> None:
    """Serve the screen at /, the page that pairs, and what the screen is joined of; the own screen as it was chosen."""
    joined, pairing = joined_screen(), (STATIC / "pair.html").read_text(encoding="utf-8")

    @app.get("/", include_in_schema=False)
    async def screen(request: Request) -> Response:
        return _page(request, joined.page)

    @app.get(PAIRING_PAGE, include_in_schema=False)
    async def pairing_page(request: Request) -> Response:
        return _page(request, pairing)

    def _page(request: Request, text: str) -> Response:
        return Response(choices.page(text) if asked(request.scope).is_own_screen else text, media_type="text/html")

    @app.get(SHEETS_AT, include_in_schema=False)
    async def style_sheets(request: Request) -> Response:
        return _conditional(request, joined.sheets, "text/css")

    @app.get(MODULES_AT, include_in_schema=False)
    async def modules(request: Request) -> Response:
        return _conditional(request, joined.modules, "text/javascript")


def _conditional(request: Request, content: str, kind: str) -> Response:
    return answer_or_unchanged(Response(content, media_type=kind), request.headers.get("if-none-match", ""))
