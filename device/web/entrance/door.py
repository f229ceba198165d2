"""Who asks: the probe's own screen, or whoever has a token; anybody else is asked for one before anything is done.

A browser brings its token in a cookie, which its scripts cannot read; programs send it as `Authorization: Bearer`. A
token that is sent in clear over the network is refused, whether it holds or not.
"""

from __future__ import annotations

from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie

from device.access.known_hosts import is_loopback
from device.access.pairing import Pairing, TryLimit
from device.access.request_rules import AskedRequest
from device.access.scopes import Need, Scope, may, need_of
from device.errors import DeviceError, ScopeNeeded, TokenNeeded, UnencryptedRequest
from device.records.tokens import TokenRecord, Tokens

COOKIE = "__Host-tsis"
"""Browsers take a cookie of this name by TLS alone, and send it nowhere else."""
SOON_S = 30 * 86_400.0
"""So long before its end a token's client is told of it, as of a certificate: time to pair the machine anew."""
SCREEN, NOBODY = "screen", "nobody"


@dataclass(frozen=True)
class Client:
    """Who asks, what he may, and by which token, None of the own screen or of nobody.

    `valid_s`: for how long (s) the token holds. `ends_at`: until when (RFC 3339), if that is soon.
    """

    name: str
    scope: Scope | None
    token_id: str | None = None
    valid_s: float | None = None
    ends_at: str | None = None


class Door:
    """Lets in the own screen, and whoever has a token of these."""

    def __init__(self, tokens: Tokens | None = None, pairing: Pairing | None = None) -> None:
        """Take the tokens there are; without any the own screen alone is let in."""
        self._tokens, self.pairing, self._limit = tokens, pairing or Pairing(), TryLimit()

    @property
    def tokens(self) -> Tokens:
        """The tokens that can be made and revoked."""
        if self._tokens is None:
            raise DeviceError("This probe keeps no tokens.", "Report the daemon's log.")
        return self._tokens

    def require(self, request: AskedRequest) -> Client:
        """Return who asks.

        Raises `UnencryptedRequest`, `TokenNeeded` or `ScopeNeeded`, and `TooManyTries` after many wrong tokens.
        """
        need, secret = need_of(request.method, request.path), bearer(request)
        if secret is None and request.is_own_screen:
            return Client(SCREEN, "admin")
        if not (request.is_encrypted or is_loopback(request.client)):
            cause = f"{request.method} {request.path} came from {request.client} without TLS."
            raise UnencryptedRequest(cause, "Ask by https; make a new token if one was sent in clear.")
        secret = secret or cookie(request)
        if need == "nothing" and secret is None:
            return Client(NOBODY, None)
        token = self._known(secret, request, need)
        if token is None:
            return Client(NOBODY, None)
        left_s = token.left_s
        ends_at = token.expires_at if left_s <= SOON_S else None
        return Client(token.name, token.scope, token.id, left_s, ends_at)

    def _known(self, secret: str | None, request: AskedRequest, need: Need) -> TokenRecord | None:
        token = self._tokens.of(secret) if self._tokens and secret else None
        if need == "nothing":
            return token
        if token is None:
            if secret is not None:
                self._limit.note(str(request.client))
                self._limit.require(str(request.client))
            cause = f"{request.method} {request.path} needs a token that holds."
            raise TokenNeeded(cause, "Pair this machine: the probe's own screen shows a code for it.")
        if not may(token.scope, need):
            cause = f"{request.method} {request.path} needs {need}, and the token of {token.name} may {token.scope}."
            remedy = "Do it at the probe's own screen, or pair with a wider scope there."
            raise ScopeNeeded(cause, remedy)
        return token


def bearer(request: AskedRequest) -> str | None:
    """Return the token of a request's `Authorization`, None without that header."""
    said = request.headers.get("authorization")
    if said is None:
        return None
    kind, _, secret = said.partition(" ")
    return secret.strip() if kind.lower() == "bearer" else ""


def cookie(request: AskedRequest) -> str | None:
    """Return the token of a request's cookie, None without one."""
    try:
        found = SimpleCookie(request.headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return None
    return found.value if found else None
