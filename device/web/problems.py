"""Errors to RFC 9457 problem+json, in this one place: title, status, detail, code and remedy."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.routing import Match, Route

from device.access.request_rules import ENDLESS
from device.errors import BusyError, DeviceError, InvalidRequest, UnknownPath
from device.measurement.quantities import InvalidQuantity

log = logging.getLogger(__name__)


REMEDY = "The API is described at /api/v1/openapi.json."
REMEDIES = {"If-Match": "Get the resource first, and send the ETag of that answer as If-Match."}
"""What to do about a field that is missing."""
LONGEST_ECHO, LONGEST_DETAIL = 80, 2000
"""Characters of a value that is told again, and of all that is told."""


def problem(error: DeviceError, status: int | None = None) -> JSONResponse:
    """Return the problem document of an error; with its own status unless another is given."""
    status = status or error.status
    body: dict[str, Any] = {
        "type": "about:blank",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": _shortened(error.cause).encode("utf-8", "backslashreplace").decode(),  # its client's may be no text
        "code": error.code,
        "remedy": error.remedy,
    }
    if isinstance(error, BusyError) and error.holder:
        body["holder"] = error.holder
    answer = JSONResponse(body, status_code=status, media_type="application/problem+json")
    if error.wait_s:
        answer.headers["Retry-After"] = str(error.wait_s)
    if status == HTTPStatus.UNAUTHORIZED:
        answer.headers["WWW-Authenticate"] = "Bearer"
    return answer


def _shortened(text: str) -> str:
    return text if len(text) <= LONGEST_DETAIL else f"{text[:LONGEST_DETAIL]} ..."


def _device_error(request: Request, error: DeviceError) -> JSONResponse:
    return problem(error)


def _invalid_quantity(request: Request, error: InvalidQuantity) -> JSONResponse:
    return problem(InvalidRequest(f"{error.quantity} is {error.value}, but must be {error.bound}.", error.action))


def _invalid_request(request: Request, error: RequestValidationError) -> JSONResponse:
    told = "; ".join(dict.fromkeys(map(_told, error.errors())))
    first = error.errors()[0]
    remedy = REMEDIES.get(first["loc"][-1]) if first["type"] == "missing" else None
    if first["loc"][0] == "query" and first["type"].startswith("datetime"):
        remedy = "Give a time as 2026-11-23T08:00:00Z; in an address the + of an offset is written %2B."
    return problem(InvalidRequest(f"{told}.", remedy or f"Correct the field. {REMEDY}"))


def _told(wrong: Mapping[str, Any]) -> str:
    """Return one thing that is wrong with a request: where, the value if it is short, and what it must be."""
    where, value, kind = ".".join(str(part) for part in wrong["loc"]), wrong.get("input"), wrong["type"]
    if kind == "json_invalid":
        return f"{where}: {wrong['msg']} ({wrong['ctx']['error']})"
    if kind == "missing":
        return f"{where} is missing"
    said = wrong["msg"].removeprefix("Value error, ")
    bound = said.removeprefix("Input should be ")
    is_told = isinstance(value, str | int | float) and len(repr(value)) <= LONGEST_ECHO
    if bound != said:
        return f"{where} is {value!r}, but must be {bound}" if is_told else f"{where} must be {bound}"
    return f"{where} is {value!r}: {said}" if is_told else f"{where}: {said}"


def _http_error(request: Request, error: HTTPException) -> JSONResponse:
    unknown = UnknownPath(f"{request.method} {request.url.path}: {error.detail}.", REMEDY)
    answer = problem(unknown, error.status_code)
    if error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        methods = _methods(request)
        has_head = "GET" in methods and request.url.path not in ENDLESS
        answer.headers["Allow"] = ", ".join(sorted(methods | ({"HEAD"} if has_head else set())))
    return answer


def _methods(request: Request) -> set[str]:
    """Return every method that the path takes: several routes may share it, and the framework names but one's."""
    routes = [route for route in request.app.routes if isinstance(route, Route)]
    return {
        method
        for route in routes
        if route.matches(request.scope)[0] is not Match.NONE
        for method in route.methods or ()
    }


def _unexpected(request: Request, error: Exception) -> JSONResponse:
    log.exception("request failed", exc_info=error)
    return problem(DeviceError("The daemon failed to answer.", "Report the daemon's log."))


def install_problems(app: FastAPI) -> None:
    """Make every error of an app a problem document."""
    handlers: dict[Any, Any] = {
        DeviceError: _device_error,
        InvalidQuantity: _invalid_quantity,
        RequestValidationError: _invalid_request,
        HTTPException: _http_error,
        Exception: _unexpected,
    }
    for kind, handler in handlers.items():
        app.add_exception_handler(kind, handler)
