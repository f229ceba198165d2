"""Pairing over REST: a code for the own screen, a token for who brings it, and the tokens there are.

A browser of another machine gets its token in a cookie that no script reads; a program gets it once, in the answer.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import FastAPI, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from device.access.pairing import Pairing
from device.access.scopes import CLAIM, PAIRING, TOKENS, Scope
from device.errors import UnknownResource
from device.records.audit import done_for
from device.records.exams import Identifier
from device.records.tokens import TokenRecord
from device.web.contract import answers
from device.web.entrance.door import COOKIE, Door
from device.web.entrance.network import ServedNetwork
from device.web.schema import Instant, NetworkResource

NO_CODE = "Ask for one at the probe's own screen."


class PairingRequest(BaseModel):
    """Who is to be paired, what his token will be allowed, and for how many days."""

    model_config = ConfigDict(extra="forbid", strict=True)
    name: Identifier
    scope: Scope = "read"
    days: Annotated[int, Field(ge=1, le=3650)] = 365


class CodeClaim(BaseModel):
    """The code on the probe's screen; a browser takes the token as a cookie."""

    model_config = ConfigDict(extra="forbid", strict=True)
    code: Annotated[str, Field(min_length=1, max_length=32)]
    as_cookie: bool = False


class PairingResource(BaseModel):
    """The code that can be brought now, by whom, and how long it holds (s)."""

    code: str
    name: str
    scope: Scope
    days: int
    valid_s: float
    network: NetworkResource | None


class TokenResource(BaseModel):
    """A token, without its secret."""

    id: str
    name: str
    scope: Scope
    made_at: Instant
    expires_at: Instant
    revoked_at: Instant | None


class NewToken(TokenResource):
    """A token with its secret, which is shown this once; null for a browser, which has it as a cookie."""

    token: str | None
    kind: Literal["Bearer"] = "Bearer"


class TokenList(BaseModel):
    """Every token there was, newest first."""

    tokens: list[TokenResource]


def add_pairing(app: FastAPI, door: Door, network: ServedNetwork | None) -> None:
    """Add the routes of codes and tokens."""
    _add_codes(app, door.pairing, network)
    _add_claim(app, door)
    _add_tokens(app, door)


def _add_codes(app: FastAPI, pairing: Pairing, network: ServedNetwork | None) -> None:
    def shown() -> dict[str, Any]:
        code = pairing.present()
        if code is None:
            raise UnknownResource("There is no pairing code now.", NO_CODE)
        said = {"code": code.shown, "name": code.name, "scope": code.scope, "days": code.days}
        return {**said, "valid_s": round(pairing.left_s(code), 1), "network": network and network.as_record()}

    @app.post(PAIRING, status_code=201, responses=answers(201, PairingResource), tags=["access"])
    def begin_pairing(request: PairingRequest) -> dict[str, Any]:
        """Make a pairing code, at the probe's own screen only; the one before ends."""
        pairing.begin(request.name, request.scope, request.days)
        return shown()

    @app.get(PAIRING, responses=answers(200, PairingResource), tags=["access"])
    def get_pairing() -> dict[str, Any]:
        """Return the code that can be brought now, at the probe's own screen only."""
        return shown()

    @app.delete(PAIRING, responses=answers(200, PairingResource), tags=["access"])
    def end_pairing() -> dict[str, Any]:
        """Let the code hold no more, at the probe's own screen only."""
        ended = shown()
        pairing.end()
        return ended


def _add_claim(app: FastAPI, door: Door) -> None:
    @app.post(CLAIM, status_code=201, responses=answers(201, NewToken), tags=["access"])
    def claim_token(claim: CodeClaim, request: Request, response: Response) -> dict[str, Any]:
        """Bring the code from the probe's screen for a token; five wrong ones a minute and machine."""
        address = request.client.host if request.client else ""
        code = door.pairing.claim(claim.code, address)
        with done_for(code.name):
            made, secret = door.tokens.make(code.name, code.scope, days=code.days)
        if claim.as_cookie:
            age_s = code.days * 86_400
            response.set_cookie(COOKIE, secret, max_age=age_s, secure=True, httponly=True, samesite="strict")
        return {**made.as_record(), "token": None if claim.as_cookie else secret, "kind": "Bearer"}


def _add_tokens(app: FastAPI, door: Door) -> None:
    @app.get(TOKENS, responses=answers(200, TokenList), tags=["access"])
    def list_tokens() -> dict[str, Any]:
        """Return the tokens there are and were."""
        return {"tokens": [token.as_record() for token in door.tokens.all()]}

    @app.delete(f"{TOKENS}/{{token_id}}", responses=answers(200, TokenResource), tags=["access"])
    def revoke_token(token_id: str) -> dict[str, Any]:
        """Let a token hold no more; what is being streamed by it ends at once."""
        revoked: TokenRecord = door.tokens.revoke(token_id)
        return revoked.as_record()
