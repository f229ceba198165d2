"""The API as its OpenAPI document, docs/openapi.json: what each route answers, and in which media type.

Every operation has a name of its own, its handler's, by which a generated client calls it; any may answer with a
problem instead, which is described once.
"""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel

from device.access.scopes import OPEN
from device.web.schema import Problem

Responses = dict[int | str, dict[str, Any]]

PNG, ZIP, EVENTS = "image/png", "application/zip", "text/event-stream"
LIVE = "multipart/x-mixed-replace"
CSV, NPZ, NETCDF, PDF = "text/csv", "application/x-npz", "application/x-netcdf", "application/pdf"
BYTES = {"type": "string", "format": "binary"}
"""How the schema of a body says that it is no text: generated clients then hand out bytes."""
TAGS = [
    {"name": "device", "description": "Which probe this is, its certificates, and the zero of its load cell."},
    {"name": "health", "description": "Whether it runs, can measure, and which part cannot."},
    {"name": "status", "description": "What the probe is doing now, asked for or streamed."},
    {"name": "presses", "description": "Start, follow, finish and cancel measurements."},
    {"name": "exams", "description": "Whose measurement it is, and the audit of what was changed."},
    {"name": "measurements", "description": "What was measured, with picture and recording."},
    {"name": "hospital", "description": "Exams as DICOM, to download or to send to the hospital's archive."},
    {"name": "exports", "description": "Take measurements away: tables, arrays, data sets, recordings."},
    {"name": "self-test", "description": "Test every part."},
    {"name": "access", "description": "Pair other machines, and revoke their tokens."},
    {"name": "updates", "description": "Releases, and what became of updates."},
]
PROBLEM: Responses = {"default": {"description": "Any error", "model": Problem}}
"""What every route may answer instead."""


OPEN_ENDED = ("FaultCode", "PressStateCode")
OPEN_FIELDS = (("Status", "step"), ("AuditEntry", "what"))
"""Enumerations of answers, and fields with one, that may get more values within v1: an unknown one breaks no client."""
BEARER = {
    "type": "http",
    "scheme": "bearer",
    "description": "A token that this machine got by pairing; for its last 30 days answers tell `Token-Expires`.",
}
PROBLEM_HEADERS = {
    "Retry-After": {"description": "Seconds to wait, where waiting helps.", "schema": {"type": "integer"}},
    "WWW-Authenticate": {"description": "Bearer, where a token is missing.", "schema": {"type": "string"}},
}
HEADERS = {
    "Location": "Where to find it.",
    "ETag": "Its version, or a hash: what If-None-Match takes, and If-Match where it can be changed.",
}


def _headers(names: tuple[str, ...]) -> dict[str, Any]:
    described = {name: {"description": HEADERS[name], "schema": {"type": "string"}} for name in names}
    return {"headers": described} if names else {}


IF_NONE_MATCH = {
    "name": "If-None-Match",
    "in": "header",
    "required": False,
    "schema": {"type": "string"},
    "description": "ETags of what the client has: is it one of them still, the answer is 304.",
}
UNCHANGED = {"description": "The client has it already, by its If-None-Match.", **_headers(("ETag",))}


def answers(status: int, model: type[BaseModel], *headers: str) -> Responses:
    """Return the description of a route's good answer and of its headers, for FastAPI's `responses`."""
    return {status: {"model": model, **_headers(headers)}}


def media(media_type: str, description: str, *headers: str) -> Responses:
    """Return the description of an answer that is no JSON, and of its headers."""
    schema = {"type": "string"} if media_type.startswith("text/") else BYTES
    return {200: {"description": description, **_headers(headers), "content": {media_type: {"schema": schema}}}}


def install_contract(app: FastAPI) -> None:
    """Make an app's document say of every operation that it may answer with the one problem, in its media type."""
    made = app.openapi

    def openapi() -> dict[str, Any]:
        return app.openapi_schema or _as_described(made())

    app.openapi = openapi  # type: ignore[method-assign]


def _as_described(document: dict[str, Any]) -> dict[str, Any]:
    """Return the document with one problem for all, and of each answer its model alone, not the handler's `dict`."""
    schema = {"$ref": "#/components/schemas/Problem"}
    content = {"application/problem+json": {"schema": schema}}
    problem = {**PROBLEM["default"], "headers": PROBLEM_HEADERS, "content": content}
    del problem["model"]
    components = document["components"]
    components["responses"], components["securitySchemes"] = {"Problem": problem}, {"bearer": BEARER}
    document["security"] = [{"bearer": []}, {}]  # the probe's own screen needs none
    for name in OPEN_ENDED:
        components["schemas"][name] = _open_ended(components["schemas"][name])
    for name, field in OPEN_FIELDS:
        fields = components["schemas"][name]["properties"]
        fields[field] = _open_ended(fields[field])
    for place, path in document["paths"].items():
        for method, operation in path.items():
            if (method.upper(), place) in OPEN:
                operation["security"] = [{}]
            for content in operation.get("requestBody", {}).get("content", {}).values():
                content["schema"] = _without_null(content["schema"])
            for answer in operation["responses"].values():
                for content in answer.get("content", {}).values():
                    content["schema"] = _named(content["schema"])
            operation["responses"]["default"] = {"$ref": "#/components/responses/Problem"}
            if method == "get" and "ETag" in operation["responses"].get("200", {}).get("headers", {}):
                operation.setdefault("parameters", []).append(IF_NONE_MATCH)
                operation["responses"]["304"] = UNCHANGED
    return document


def _open_ended(schema: dict[str, Any]) -> dict[str, Any]:
    """Return an enumeration as text that has these values now."""
    told = f"{schema.get('description', '')} More may come: take an unknown one as text.".strip()
    return {"type": "string", "title": schema["title"], "description": told, "x-extensible-enum": schema["enum"]}


def _without_null(schema: dict[str, Any]) -> dict[str, Any]:
    """Return what a body may be, where there is one: generated clients cannot send one of a union with null."""
    kinds = [one for one in schema.get("anyOf", []) if one != {"type": "null"}]
    return _named(kinds[0]) if len(kinds) == 1 else schema


def _named(schema: dict[str, Any]) -> dict[str, Any]:
    return {"$ref": schema["$ref"]} if "$ref" in schema else schema
