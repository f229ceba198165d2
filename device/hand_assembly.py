"""Lets the virtual hand read the guidance of whatever leads its presses."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol, TypeVar

from device.instrument.guidance import Guidance, before_contact
from device.instrument.status import StatusBoard
from device.measurement.mode import Mode
from device.simulation.virtual_probe import VirtualProbe


class Guide(Protocol):
    """What leads an operator through presses: the guidance on its board, and word of each press that is to begin."""

    board: StatusBoard

    def on_request(self, listener: Callable[[Mode], None]) -> None:
        """Call `listener` with the mode whenever a press is to begin."""


SomeGuide = TypeVar("SomeGuide", bound=Guide)


def lead_by_hand(guide: Guide, probe: VirtualProbe) -> None:
    """Let the virtual hand read the screen: it takes up the probe when a press is requested."""

    def follow(guidance: Guidance) -> None:
        probe.hand.follow(guidance.code, time.monotonic())

    def begin(mode: Mode) -> None:
        probe.hand.begin()
        guidance = guide.board.now.guidance
        if guidance is before_contact("reference", mode):  # shown since before the hand took up the probe
            follow(guidance)

    guide.board.on_guidance(follow)
    guide.on_request(begin)
