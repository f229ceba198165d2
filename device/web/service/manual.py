"""The API's description as a page at /docs: what docs/openapi.json says, for a reader, without a script or a network.

The pages that the framework has load their programs from elsewhere, which a probe in a hospital cannot and its own
policy does not allow.
"""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import Any

from fastapi import FastAPI
from fastapi.responses import HTMLResponse

_Described = dict[str, Any]
_Rows = list[tuple[str, ...]]
STYLE = "/static/manual.css"
MODELS = "#/components/schemas/"


def manual(document: _Described) -> str:
    """Return the page of an OpenAPI document: operations by their tags, then the models that they name."""
    return "\n".join(_page(document)) + "\n"


def _page(document: _Described) -> Iterator[str]:
    title = f"{document['info']['title']} {document['info']['version']}"
    yield f'<!doctype html>\n<html lang="en">\n<head><meta charset="utf-8"><title>{escape(title)}: API</title>'
    yield f'<meta name="viewport" content="width=device-width"><link rel="stylesheet" href="{STYLE}"></head>\n<body>'
    yield f"<h1>{escape(title)}: the API</h1>"
    yield '<p>For programs: <a href="/api/v1/openapi.json">openapi.json</a>.</p>\n<nav><ul>'
    for tag in document["tags"]:
        yield f'<li><a href="#{escape(tag["name"])}">{escape(tag["name"])}</a></li>'
    yield '<li><a href="#models">models</a></li></ul></nav>\n<main>'
    for tag in document["tags"]:
        yield f'<h2 id="{escape(tag["name"])}">{escape(tag["name"])}</h2>\n<p>{escape(tag["description"])}</p>'
        for path, methods in document["paths"].items():
            for method, operation in methods.items():
                if tag["name"] in operation["tags"]:
                    yield from _operation(method, path, operation)
    yield '<h2 id="models">Models</h2>'
    for name, schema in sorted(document["components"]["schemas"].items()):
        yield from _model(name, schema)
    yield "</main></body></html>"


def _operation(method: str, path: str, operation: _Described) -> Iterator[str]:
    name = operation["operationId"]
    yield f'<section id="{escape(name)}"><h3><code>{method.upper()} {escape(path)}</code></h3>'
    yield from _paragraphs(operation.get("description", ""))
    parameters = operation.get("parameters", [])
    if parameters:
        rows: _Rows = [
            (one["name"], f"{one['in']}{', required' if one.get('required') else ''}", _kind(one["schema"]),
             escape(one.get("description", "")))
            for one in parameters
        ]  # fmt: skip
        yield from _table(("parameter", "where", "what", "meaning"), rows)
    for media_type, content in operation.get("requestBody", {}).get("content", {}).items():
        yield f"<p>Body, <code>{escape(media_type)}</code>: {_kind(content.get('schema', {}))}</p>"
    yield "<ul>"
    for status, answer in operation["responses"].items():
        yield f"<li>{_answer(status, answer)}</li>"
    yield "</ul></section>"


def _answer(status: str, answer: _Described) -> str:
    if "$ref" in answer:
        return f"else: {_link('Problem')}, an error with its remedy"
    contents = answer.get("content", {}).items()
    said = ", ".join(f"<code>{escape(media)}</code> {_kind(one.get('schema', {}))}" for media, one in contents)
    headers = ", ".join(f"<code>{escape(name)}</code>" for name in answer.get("headers", {}))
    meaning = escape(answer.get("description", ""))
    return "; ".join(part for part in (f"{status}: {said}" if said else status, headers, meaning) if part)


def _model(name: str, schema: _Described) -> Iterator[str]:
    yield f'<section id="{escape(name)}"><h3>{escape(name)}</h3>'
    yield from _paragraphs(schema.get("description", ""))
    required = schema.get("required", ())
    rows: _Rows = [
        (field, "always" if field in required else "", _kind(one), escape(one.get("description", "")))
        for field, one in schema.get("properties", {}).items()
    ]
    if rows:
        yield from _table(("field", "there", "what", "meaning"), rows)
    else:
        yield f"<p>{_kind(schema)}</p>"
    yield "</section>"


def _table(heads: tuple[str, ...], rows: _Rows) -> Iterator[str]:
    """Yield a table; the first cell of a row is a name, the last two are HTML."""
    yield "<table><tr>" + "".join(f"<th>{head}</th>" for head in heads) + "</tr>"
    for name, where, *cells in rows:
        yield f"<tr><td><code>{escape(name)}</code></td><td>{escape(where)}</td>"
        yield "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"
    yield "</table>"


def _paragraphs(text: str) -> Iterator[str]:
    for paragraph in text.split("\n\n"):
        if paragraph:
            yield f"<p>{escape(paragraph)}</p>"


def _kind(schema: _Described) -> str:
    """Return in words and links what values a schema takes."""
    if "$ref" in schema:
        return _link(schema["$ref"].removeprefix(MODELS))
    for one_of in ("anyOf", "oneOf", "allOf"):
        if one_of in schema:
            return " or ".join(_kind(one) for one in schema[one_of])
    for values, more in (("enum", []), ("x-extensible-enum", ["others that came later"])):
        if values in schema:
            return " or ".join([*(f"<code>{escape(str(one))}</code>" for one in schema[values]), *more])
    if "const" in schema:
        return f"<code>{escape(str(schema['const']))}</code>"
    if schema.get("type") == "array":
        return f"list of {_kind(schema.get('items', {}))}"
    kind = escape(schema.get("format") or schema.get("type", "anything"))
    bounds = [f"{word} {schema[key]}" for key, word in BOUNDS.items() if key in schema]
    return f"{kind} ({escape(', '.join(bounds))})" if bounds else kind


BOUNDS = {
    "minimum": "from", "exclusiveMinimum": "above", "maximum": "to", "exclusiveMaximum": "below",
    "minLength": "at least characters:", "maxLength": "at most characters:", "pattern": "as", "default": "else",
}  # fmt: skip


def _link(name: str) -> str:
    return f'<a href="#{escape(name)}">{escape(name)}</a>'


def add_manual(app: FastAPI) -> None:
    """Add the page of the app's own document."""

    @app.get("/docs", include_in_schema=False)
    def get_manual() -> HTMLResponse:
        return HTMLResponse(manual(app.openapi()))
