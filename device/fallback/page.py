"""The situation as a page of the probe's screen, and as a problem document of the REST API. Nothing is decided here."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from html import escape
from typing import Any

from device.errors import DeviceError
from device.fallback.address import ServedAddress
from device.fallback.situation import Situation

STATUS = 503
REMEDY = "Ask again in a few seconds; the probe's screen says more."


def problem(situation: Situation) -> dict[str, Any]:
    """Return what the API answers instead of the daemon: the first fault as RFC 9457 has it, all under `faults`."""
    first = situation.faults[0] if situation.faults else _nothing_told(situation).as_record()
    return {
        "type": "about:blank",
        "title": "Service Unavailable",
        "status": STATUS,
        "detail": first["cause"],
        "code": first["code"],
        "remedy": first["remedy"],
        "faults": list(situation.faults) or [first],
        "release": situation.release or None,
    }


def _nothing_told(situation: Situation) -> DeviceError:
    return DeviceError(f"{situation.headline}. {situation.hint}", REMEDY)


def revision(situation: Situation) -> str:
    """Return a text that changes when the page does."""
    return hashlib.sha256(json.dumps(vars(situation)).encode()).hexdigest()[:16]


def page(situation: Situation, address: ServedAddress, *, is_local: bool, has_support: bool) -> str:
    """Return the whole page; what changes something, and the log, stand on it only for the screen at the probe."""
    return PAGE.format(
        revision=revision(situation),
        serial=escape(address.serial),
        headline=escape(situation.headline),
        hint=escape(situation.hint),
        tone="bad" if situation.faults else "calm",
        icon="fault" if situation.faults else "wait",
        faults="".join(map(_fault, situation.faults)),
        log=_log(situation.log) if is_local else "",
        facts="".join(_fact(*fact) for fact in _facts(situation, address)),
        buttons="".join(_buttons(situation, has_support)) if is_local else "",
        release=escape(situation.release or "not installed as a release"),
    )


def _fault(fault: dict[str, str]) -> str:
    code, title, cause, remedy = (escape(fault[field]) for field in ("code", "title", "cause", "remedy"))
    return (
        f'<div class="fault" data-severity="{escape(fault["severity"])}"><p class="fault-name">'
        f'<span class="fault-code">{code}</span><span class="fault-title">{title}</span></p>'
        f'<p class="fault-words"><strong class="fault-cause">{cause}</strong> '
        f'<span class="fault-remedy">{remedy}</span></p></div>'
    )


def _log(lines: Sequence[str]) -> str:
    if not lines:
        return ""
    return f'<pre class="log" aria-label="Last lines of the log">{escape(chr(10).join(lines))}</pre>'


def _facts(situation: Situation, address: ServedAddress) -> list[tuple[str, str]]:
    good = situation.last_good or "none other on this probe"
    return [("Last good release", good), ("Reached at", "  ".join(address.ways))]


def _fact(name: str, value: str) -> str:
    return f"<p><small>{escape(name)}</small> {escape(value)}</p>"


def _buttons(situation: Situation, has_support: bool) -> list[str]:
    found = []
    if situation.may_roll_back:
        found.append(_button("roll-back", f"Go back to {situation.last_good}"))
    if has_support:
        found.append(_button("support", "Save support file"))
    return found


def _button(name: str, words: str) -> str:
    return f'<button id="{name}" class="button" type="button">{escape(words)}</button>'


PAGE = """<!doctype html>
<html lang="en">
<head>
  <meta charset="utf-8">
  <meta name="viewport" content="width=device-width, initial-scale=1">
  <title>TSIS tactile probe</title>
  <link rel="icon" href="data:,">
  <link rel="stylesheet" href="/static/screen.css">
  <link rel="stylesheet" href="/static/fallback.css">
  <script type="module" src="/static/fallback.js"></script>
</head>
<body data-revision="{revision}">
  <svg class="visually-hidden" aria-hidden="true">
    <symbol id="icon-wait" viewBox="0 0 48 48"><circle cx="24" cy="24" r="18"/><path d="M24 14v10l7 5"/></symbol>
    <symbol id="icon-fault" viewBox="0 0 48 48"><path d="M24 6L44 41H4zM24 19v11M24 35.5v.5"/></symbol>
  </svg>
  <div id="panel" class="panel" data-tone="{tone}">
    <header class="header">
      <h1 class="product"><abbr title="Tactile Sensation Imaging System">TSIS</abbr></h1>
      <p class="serial" aria-label="Serial number">{serial}</p>
    </header>
    <main class="fallback">
      <section class="instruction">
        <svg class="icon" aria-hidden="true"><use href="#icon-{icon}"/></svg>
        <p id="instruction">{headline}</p>
      </section>
      <p class="hint">{hint}</p>
      <section class="reasons" role="alert" aria-label="Faults" tabindex="0">{faults}{log}</section>
      <section class="facts">{facts}</section>
      <section class="ways-out">{buttons}<p id="told" aria-live="polite"></p></section>
    </main>
    <footer class="footer"><p>Documents size, depth and modulus. Not a diagnosis.</p><p>Software {release}</p></footer>
  </div>
</body>
</html>
"""
