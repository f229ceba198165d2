"""What a request must say of itself before anything is done for it: host, origin, content type and size of its body.

A page of another origin can send a browser's user here, and so reach a probe that listens on loopback alone. It can
send only what needs no leave (a CORS preflight): never `application/json`, and always with its own origin. Programs
that are no browsers send neither `Origin` nor `Sec-Fetch-Site`, and are let through; where they send no body, they need
not say of which type it is.
Source: the Fetch standard, "CORS-safelisted request-header"; and Fetch Metadata.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from email.message import Message

from device.access.known_hosts import LOOPBACK, KnownHosts, is_loopback, split_authority
from device.errors import BodyTooLarge, ForeignRequest, UnknownHost, UnknownPath, WrongContentType

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
"""What asks and changes nothing."""
OWN_SITES = frozenset({"same-origin", "none"})
"""What `Sec-Fetch-Site` says of a request by this origin's own page, or by the user alone."""
PORTS = {"http": 80, "https": 443}
UTF_8 = ("utf-8", "utf8", "us-ascii")
BUFFERED = "application/json"
FORWARDED = ("forwarded", "via", "x-forwarded-for", "x-forwarded-host", "x-forwarded-proto", "x-real-ip")
"""What a proxy says of a request that it passes on."""


@dataclass(frozen=True)
class BodyRule:
    """What may be sent to a path: which content type, at most how much (bytes), and from where.

    A body that is `streamed` is never held in memory as a whole: its route reads it piece by piece.
    """

    content_type: str = BUFFERED
    max_bytes: int = 64 * 1024
    streamed: bool = False
    local_only: bool = False


ENDLESS = ("/api/v1/events", "/api/v1/live.mjpeg")
"""Answers that go on: of these HEAD is refused."""
JSON_BODY = BodyRule()
BODY_RULES: Mapping[str, BodyRule] = {
    "/api/v1/updates": BodyRule("application/octet-stream", 300_000_000, streamed=True, local_only=True),
    "/api/v1/updates/roll-back": BodyRule(local_only=True),
    "/api/v1/pairing": BodyRule(local_only=True),
    "/api/v1/screen": BodyRule(local_only=True),
}
"""The paths with a rule of their own: release files, going back to one, pairing and what is chosen
at the own screen are its alone."""


@dataclass(frozen=True)
class AskedRequest:
    """What a request says, and between which addresses it came; the headers' names are in lower case."""

    method: str
    path: str
    headers: Mapping[str, str]
    served_at: str | None = None
    client: str | None = None
    is_encrypted: bool = False
    http_version: str = "1.1"

    @property
    def is_own_screen(self) -> bool:
        """Whether it comes from this very machine, by its loopback name, and no proxy passed it on.

        A proxy on the machine comes by loopback, too, for whoever asks it. One tells itself by its headers, by a Host
        that it passes on as it came, or by HTTP/1.0, in which nginx forwards unless told otherwise.
        """
        name, _ = split_authority(self.headers.get("host", ""))
        is_passed_on = any(header in self.headers for header in FORWARDED) or self.http_version == "1.0"
        return is_loopback(self.client) and name in LOOPBACK and not is_passed_on

    @property
    def is_safe(self) -> bool:
        """Whether it only asks."""
        return self.method in SAFE_METHODS

    @property
    def has_body(self) -> bool:
        """Whether a body follows, by its headers."""
        return "transfer-encoding" in self.headers or self.headers.get("content-length", "0") != "0"

    @property
    def is_empty(self) -> bool:
        """Whether neither a body follows nor a type of one is said."""
        return not self.has_body and "content-type" not in self.headers

    @property
    def is_of_browser(self) -> bool:
        """Whether a page may have sent it: with a request that changes something a browser says from where."""
        return "origin" in self.headers or "sec-fetch-site" in self.headers

    @property
    def rule(self) -> BodyRule:
        """What may be sent to its path."""
        return BODY_RULES.get(self.path, JSON_BODY)


def joined(headers: Iterable[tuple[str, str]]) -> dict[str, str]:
    """Return headers by name in lower case; what is there twice is joined, and so is neither of the two."""
    found: dict[str, str] = {}
    for name, value in headers:
        key = name.lower()
        found[key] = f"{found[key]}, {value}" if key in found else value
    return found


def require_allowed(request: AskedRequest, hosts: KnownHosts) -> None:
    """Raise the fault of a request that must not be answered.

    `UnknownHost` and `UnknownPath` for any request; `ForeignRequest` and `WrongContentType` for one that would change
    something; `BodyTooLarge` by what it says of its body's size.
    """
    _require_known_host(request, hosts)
    _require_plain_path(request)
    if not request.is_safe:
        _require_own_origin(request)
        _require_content_type(request)
    size = request.headers.get("content-length", "0")
    if not size.isdecimal() or int(size) > request.rule.max_bytes:
        raise too_large(request.rule)


def require_local(request: AskedRequest) -> None:
    """Raise `ForeignRequest` unless a request comes from this very machine, by loopback and by no proxy."""
    if not request.is_own_screen:
        raise ForeignRequest(
            f"{request.method} {request.path} comes from {request.client}, which is not the probe's own screen.",
            "This is done at the probe's own screen, http://127.0.0.1.",
        )


def too_large(rule: BodyRule) -> BodyTooLarge:
    """Return the fault of a body that is larger than its path takes."""
    return BodyTooLarge(
        f"The body is larger than {rule.max_bytes // 1024} kB, or does not say its size in a number.",
        "Send what the path takes; it was not read.",
    )


def _require_known_host(request: AskedRequest, hosts: KnownHosts) -> None:
    host = request.headers.get("host", "")
    if not hosts.has(host, request.served_at):
        raise UnknownHost(
            f"Host is {host[:100]!r}, which is no name of this probe.",
            "Use its address or its host name, or add the name to the setting server.hosts.",
        )


def _require_plain_path(request: AskedRequest) -> None:
    """Refuse a path with a line's end in it, and all else that no text shows.

    Rules compare a path as it is, but routes match it with `$`, which passes over a line feed at the end: what a token
    may must not depend on it. Source: Python's `re`, "$".
    """
    if not request.path.isprintable():
        raise UnknownPath(f"No path of this probe is {request.path[:100]!a}.", "Ask for a path of docs/openapi.json.")


def _require_own_origin(request: AskedRequest) -> None:
    site, origin = request.headers.get("sec-fetch-site"), request.headers.get("origin")
    if (site is not None and site not in OWN_SITES) or (origin is not None and not _is_own(origin, request)):
        who = origin if origin is not None else site
        raise ForeignRequest(
            f"{request.method} {request.path} was sent by a page of another origin ({str(who)[:100]}).",
            "Use the probe's own screen; a proxy before it has to pass Host on as it came.",
        )
    if request.rule.local_only:
        require_local(request)


def _is_own(origin: str, request: AskedRequest) -> bool:
    """Return whether an origin is that of the page that this very host and port serve."""
    scheme, _, authority = origin.partition("://")
    default = PORTS.get(scheme.lower())
    if default is None:
        return False
    (name, port), (own, own_port) = split_authority(authority), split_authority(request.headers.get("host", ""))
    return bool(name) and (name, port or default) == (own, own_port or default)


def _require_content_type(request: AskedRequest) -> None:
    if request.method == "DELETE" and not request.has_body:
        return  # no page sends one to another origin without asking for leave
    if request.is_empty and not request.is_of_browser:
        return
    stated = request.headers.get("content-type", "")
    if stated.partition(";")[0].strip().lower() != request.rule.content_type:
        raise WrongContentType(
            f"Content-Type is {stated[:100]!r}, but must be {request.rule.content_type!r}, also for an empty body.",
            f"Send the header Content-Type: {request.rule.content_type}.",
        )
    _require_readable(request, stated)


def _require_readable(request: AskedRequest, stated: str) -> None:
    """Refuse a body that says that it is compressed, or that its text is not UTF-8 (RFC 8259, section 8.1)."""
    coding = request.headers.get("content-encoding", "").strip().lower()
    if coding not in ("", "identity"):
        raise WrongContentType(f"Content-Encoding is {coding[:40]!r}.", "Send the body without compression.")
    header = Message()
    header["Content-Type"] = stated
    if (charset := header.get_content_charset("utf-8")) not in UTF_8:
        raise WrongContentType(f"The charset of the body is {charset[:40]!r}.", "Send text in UTF-8.")
