"""The situation as a page of the probe's screen in a language, and as a problem document of the REST API.

Nothing is decided here.
"""

from __future__ import annotations

import hashlib
import json
from html import escape
from typing import Any

from device.errors import DeviceError
from device.fallback.address import ServedAddress
from device.fallback.situation import Situation
from device.fallback.words import PageWords

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


def page(
    situation: Situation,
    address: ServedAddress,
    words: PageWords,
    *,
    is_local: bool,
    has_support: bool,
    colours: str = "auto",
) -> str:
    """Return the whole page; what changes something, and the log, stand on it only for the screen at the probe."""

    def said(text: str, **values: str) -> str:
        return escape(words.say(text, **values))

    return PAGE.format(
        language=words.language,
        colours=escape(colours),
        revision=revision(situation),
        serial=escape(address.serial),
        serial_number=said("Serial number"),
        headline=said(situation.headline),
        hint=said(situation.hint),
        tone="bad" if situation.faults else "calm",
        icon="fault" if situation.faults else "wait",
        faults_name=said("Faults"),
        faults="".join(_fault(fault, words) for fault in situation.faults),
        service=_service(situation, words, is_local=is_local),
        facts="".join(_fact(*fact) for fact in _facts(situation, address, words)),
        buttons="".join(_buttons(situation, words, has_support)) if is_local else "",
        moment=said("One moment."),
        refused=said("It did not work."),
        no_diagnosis=said("Documents size, depth and modulus. Not a diagnosis."),
        software=said("Software {version}", version=situation.release or words.say("not installed as a release")),
    )


def _fault(fault: dict[str, str], words: PageWords) -> str:
    code, title, remedy = escape(fault["code"]), escape(words.meaning(fault)), escape(words.remedy(fault))
    return (
        f'<div class="fault" data-severity="{escape(fault["severity"])}"><span class="fault-code">{code}</span>'
        f'<p class="fault-words"><strong class="fault-title">{title}</strong> '
        f'<span class="fault-remedy">{remedy}</span></p></div>'
    )


def _service(situation: Situation, words: PageWords, *, is_local: bool) -> str:
    """Return what service needs, one tap away: the faults' own words and the log, which are in English."""
    told = "".join(
        f'<p class="fault-cause">{escape(fault["code"])} {escape(fault["cause"])} {escape(fault["remedy"])}</p>'
        for fault in situation.faults
    )
    if is_local and situation.log:
        name, lines = escape(words.say("Last lines of the log")), escape("\n".join(situation.log))
        told += f'<pre class="log" aria-label="{name}">{lines}</pre>'
    if not told:
        return ""
    details = escape(words.say("Details"))
    return f'<details class="service"><summary class="button button-quiet">{details}</summary>{told}</details>'


def _facts(situation: Situation, address: ServedAddress, words: PageWords) -> list[tuple[str, str]]:
    good = situation.last_good or words.say("none other on this probe")
    return [(words.say("Last good release"), good), (words.say("Reached at"), "  ".join(address.ways))]


def _fact(name: str, value: str) -> str:
    return f"<p><small>{escape(name)}</small> {escape(value)}</p>"


def _buttons(situation: Situation, words: PageWords, has_support: bool) -> list[str]:
    found = []
    if situation.may_roll_back:
        done = words.say("The probe goes back to its last good release.")
        found.append(_button("roll-back", words.say("Go back to {release}", release=situation.last_good), done))
    if has_support:
        done = words.say("The support file is with this browser's downloads.")
        panel = words.say("No file can be saved here. Service: python -m device support.")
        found.append(_button("support", words.say("Save support file"), done, panel))
    return found


def _button(name: str, words: str, done: str, panel: str = "") -> str:
    """Return a button that says in its data what is said once it has been done, or instead on the probe's panel."""
    data = f'data-done="{escape(done)}" data-panel="{escape(panel)}"'
    return f'<button id="{name}" class="button" type="button" {data}>{escape(words)}</button>'


PAGE = """<!doctype html>
<html lang="{language}" data-colours="{colours}">
<head>
  <meta charset="utf-8">
  <meta name="viewport" content="width=device-width, initial-scale=1">
  <title>TSIS tactile probe</title>
  <link rel="icon" href="data:,">
  <link rel="stylesheet" href="/static/screen.css">
  <link rel="stylesheet" href="/static/fallback.css">
  <script type="module" src="/static/fallback.js"></script>
</head>
<body data-revision="{revision}" data-moment="{moment}" data-refused="{refused}">
  <svg class="visually-hidden" aria-hidden="true">
    <symbol id="icon-wait" viewBox="0 0 48 48"><circle cx="24" cy="24" r="18"/><path d="M24 14v10l7 5"/></symbol>
    <symbol id="icon-fault" viewBox="0 0 48 48"><path d="M24 6L44 41H4zM24 19v11M24 35.5v.5"/></symbol>
  </svg>
  <div id="panel" class="panel" data-tone="{tone}">
    <header class="header">
      <h1 class="product"><abbr title="Tactile Sensation Imaging System">TSIS</abbr></h1>
      <p class="serial" aria-label="{serial_number}">{serial}</p>
    </header>
    <main class="fallback">
      <section class="instruction">
        <svg class="icon" aria-hidden="true"><use href="#icon-{icon}"/></svg>
        <p id="instruction">{headline}</p>
      </section>
      <p class="hint">{hint}</p>
      <div class="known" role="region" aria-label="{faults_name}" tabindex="0">
        <section class="reasons" role="alert">{faults}{service}</section>
        <section class="facts">{facts}</section>
      </div>
      <section class="ways-out">{buttons}<p id="told" aria-live="polite"></p></section>
    </main>
    <footer class="footer"><p>{no_diagnosis}</p><p>{software}</p></footer>
  </div>
</body>
</html>
"""
