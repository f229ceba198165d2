"""Hands as people have them, drawn at random, and whether a press by such a hand ought to be measured.

What ought to be is said from the hand's own numbers and the settings of the press, before anyone presses. Between good
and bad lies a grey zone in which either verdict is right: there the chance of the moment decides what the probe sees.
Tremor of 8-12 Hz: Elble & Koller, Tremor (1990). Amplitudes, speeds and reaction times are assumed.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, hypot, pi, sin
from typing import Literal

import numpy as np

from device.config import Config
from device.instrument.press.machine import MAX_LIFTS, STEADY_WINDOW_S, PressRules
from device.measurement.mode import FRAMES, RAMP_FROM_N, RAMP_TO_N, Mode
from device.simulation.hand import HandSettings

Verdict = Literal["good", "bad", "grey"]
Draw = Callable[[np.random.Generator, Mode], HandSettings]

LARGEST_TREMOR, SMALLEST_TREMOR = 3.0, 1.0
"""Peak to peak of the hand's tremor over `tremor_n` while it swells, and while it fades."""
WANDER = 1.4
"""Largest deviation of the hand's drift over `drift_n`; its slope over `drift_n` is `WANDER_PER_S`."""
WANDER_PER_S = 5.3
SAMPLED_TREMOR = 0.7
"""At least so much of the tremor's peak to peak is left by 80 samples a second in a short window around a line."""
NEEDED_S = 0.35
"""A hold of less cannot give ten frames at 30 Hz after the force has been steady for its window."""
RAMP_NEEDED_N = 0.4
"""Over less of a ramp not every one of its forces is seen."""


def person(rng: np.random.Generator, mode: Mode, **habits: float) -> HandSettings:
    """Return a hand of ordinary steadiness that looks at the gauge, with some other habits."""
    direction, miss_mm = rng.uniform(0, 2 * pi), rng.uniform(0.0, 1.5)
    ordinary = {
        "rate_n_per_s": rng.uniform(0.2, 2.5),
        "ramp_rate_n_per_s": rng.uniform(0.15, 0.22),
        "reaction_s": rng.uniform(0.15, 0.5),
        "aim_n": rng.uniform(0.35, 0.6),
        "ramp_aim_n": rng.uniform(0.65, 0.75),
        "corrects_to_n": rng.uniform(0.494, 0.506),
        "overshoot_ratio": rng.uniform(0.0, 0.3),
        "fade_n_per_s": rng.uniform(-0.015, 0.015),
        "tremor_hz": rng.uniform(8.0, 10.0),
        "tremor_n": rng.uniform(0.0005, 0.003),
        "drift_n": rng.uniform(0.0, 0.006),
        "miss_x_mm": miss_mm * cos(direction),
        "miss_y_mm": miss_mm * sin(direction),
    }
    return HandSettings(**{**ordinary, **habits})


def too_hard(rng: np.random.Generator, mode: Mode) -> HandSettings:
    """Return a hand that means to press much harder, or comes down so fast that it goes far beyond."""
    fast = {"ramp_rate_n_per_s": rng.uniform(4.0, 8.0), "reaction_s": rng.uniform(0.35, 0.6)}
    heavy = {**fast, "ramp_aim_n": rng.uniform(1.2, 1.6)}
    if rng.random() < 0.5:
        return person(rng, mode, **heavy, aim_n=rng.uniform(1.15, 1.6), corrects_to_n=None)
    return person(rng, mode, **heavy, aim_n=0.5, overshoot_ratio=rng.uniform(1.4, 2.0), rate_n_per_s=3.0)


def trembling(rng: np.random.Generator, mode: Mode) -> HandSettings:
    """Return a hand whose tremor is several times that of an ordinary one."""
    return person(rng, mode, tremor_n=rng.uniform(0.06, 0.1) if FRAMES[mode].is_ramp else rng.uniform(0.037, 0.08))


def double(rng: np.random.Generator, mode: Mode) -> HandSettings:
    """Return a hand that bounces: it lifts in the middle and comes back at once, again and again."""
    return person(
        rng, mode, early_lifts=99, lifts_after_s=rng.uniform(0.4, 0.54), rate_n_per_s=rng.uniform(1.5, 2.5),
        reaction_s=0.1, aim_n=0.5, corrects_to_n=None, overshoot_ratio=0.0,
    )  # fmt: skip


def lifts_early(rng: np.random.Generator, mode: Mode) -> HandSettings:
    """Return a hand that lifts before it is told to, each time it is asked to press again."""
    rate = rng.uniform(0.5, 1.5)
    longest_s = 1.6 if FRAMES[mode].is_ramp else 0.5 / rate + 0.3
    return person(
        rng, mode, early_lifts=99, lifts_after_s=rng.uniform(0.6, 1.0) * longest_s, rate_n_per_s=rate,
        aim_n=0.5, corrects_to_n=None, overshoot_ratio=0.0,
    )  # fmt: skip


def never_reaching(rng: np.random.Generator, mode: Mode) -> HandSettings:
    """Return a hand that stays below the forces that are wanted, whatever the screen says."""
    return person(rng, mode, aim_n=rng.uniform(0.2, 0.44), corrects_to_n=None, overshoot_ratio=0.0,
                  fade_n_per_s=0.0, ramp_aim_n=rng.uniform(0.2, 0.55))  # fmt: skip


def off_centre(rng: np.random.Generator, mode: Mode) -> HandSettings:
    """Return a hand that presses far beside the lesion's middle."""
    direction, miss_mm = rng.uniform(0, 2 * pi), rng.uniform(5.0, 8.0)
    return person(rng, mode, miss_x_mm=miss_mm * cos(direction), miss_y_mm=miss_mm * sin(direction))


def drifting(rng: np.random.Generator, mode: Mode) -> HandSettings:
    """Return a hand that cannot hold: it slides through the band, faster than a ramp may."""
    fade = float(rng.choice([-1, 1])) * rng.uniform(0.4, 0.8)
    return person(rng, "paper", fade_n_per_s=fade, rate_n_per_s=rng.uniform(0.5, 2.5))


def borderline(rng: np.random.Generator, mode: Mode) -> HandSettings:
    """Return a hand between good and bad in one respect."""
    habits = [
        {"tremor_n": rng.uniform(0.005, 0.02)},
        {"corrects_to_n": float(rng.choice([0.48, 0.52])), "drift_n": 0.012},
        {"fade_n_per_s": rng.uniform(0.05, 0.3)},
        {"early_lifts": int(rng.integers(1, 3)), "lifts_after_s": rng.uniform(0.8, 1.5)},
        {"miss_x_mm": rng.uniform(2.0, 4.0)},
        {"ramp_rate_n_per_s": rng.uniform(0.4, 0.8)},
    ]
    return person(rng, mode, **habits[rng.integers(len(habits))])


KINDS: dict[str, Draw] = {
    "ordinary": person,
    "too hard": too_hard,
    "tremor": trembling,
    "double": double,
    "lifts early": lifts_early,
    "never reaching": never_reaching,
    "off-centre": off_centre,
    "drift": drifting,
    "borderline": borderline,
}


def verdict(hand: HandSettings, mode: Mode, config: Config) -> Verdict:
    """Return whether a press by this hand ought to be measured; "grey" when that is left to the moment."""
    is_ramp = FRAMES[mode].is_ramp
    if _is_bad(hand, config) or (_is_bad_ramp(hand, config) if is_ramp else _is_bad_hold(hand, config)):
        return "bad"
    if _is_good(hand, config) and (_is_good_ramp(hand, config) if is_ramp else _is_good_hold(hand, config)):
        return "good"
    return "grey"


def wander_n(hand: HandSettings) -> float:
    """Return how far the force of a hand that holds strays from what it means to hold, at most."""
    return LARGEST_TREMOR / 2 * hand.tremor_n + WANDER * hand.drift_n


def _is_bad(hand: HandSettings, config: Config) -> bool:
    return hypot(*hand.on_lesion_mm) >= 2 * config.press.max_offset_mm


def _trembles(hand: HandSettings, allowed_n: float) -> bool:
    return SAMPLED_TREMOR * SMALLEST_TREMOR * hand.tremor_n > 1.2 * allowed_n


def _is_bad_hold(hand: HandSettings, config: Config) -> bool:
    press, settles_at_n = config.press, hand.corrects_to_n or hand.aim_n
    first_n = hand.aim_n * (1 + hand.overshoot_ratio)
    is_fast = (press.overload_n - press.band_n[1]) / hand.rate_n_per_s < hand.reaction_s
    too_hard = first_n - wander_n(hand) > 1.05 * press.overload_n and (is_fast or hand.corrects_to_n is None)
    never_there = settles_at_n + wander_n(hand) < 0.98 * press.band_n[0] and not hand.fade_n_per_s
    held_s = hand.lifts_after_s - hand.aim_n / hand.rate_n_per_s
    lifts = hand.early_lifts > 2 * MAX_LIFTS and held_s < NEEDED_S
    slides = abs(hand.fade_n_per_s) > 1.1 * press.max_rate_n_per_s and hand.rate_n_per_s > press.max_rate_n_per_s
    return too_hard or never_there or lifts or slides or _trembles(hand, press.steady_n)


def _is_bad_ramp(hand: HandSettings, config: Config) -> bool:
    reached_n = min(hand.ramp_aim_n, hand.ramp_rate_n_per_s * hand.reaction_s)
    too_hard = reached_n - wander_n(hand) > 1.05 * config.press.overload_n
    never_there = hand.ramp_aim_n + wander_n(hand) < RAMP_TO_N
    lifts = hand.early_lifts > 2 * MAX_LIFTS and hand.lifts_after_s * hand.ramp_rate_n_per_s < RAMP_NEEDED_N
    trembles = _trembles(hand, PressRules.of(config.press, (RAMP_FROM_N, RAMP_TO_N), is_ramp=True).steady_n)
    return too_hard or never_there or lifts or trembles


def _is_good(hand: HandSettings, config: Config) -> bool:
    varies_n = LARGEST_TREMOR * hand.tremor_n + WANDER_PER_S * STEADY_WINDOW_S * hand.drift_n
    is_steady = varies_n + STEADY_WINDOW_S * abs(hand.fade_n_per_s) <= 0.8 * config.press.steady_n
    return is_steady and not hand.early_lifts and hypot(*hand.on_lesion_mm) <= 0.65 * config.press.max_offset_mm


def _is_good_hold(hand: HandSettings, config: Config) -> bool:
    press = config.press
    off_n = abs((hand.corrects_to_n or hand.aim_n) - press.target_n) + wander_n(hand)
    is_gentle = hand.aim_n * (1 + hand.overshoot_ratio) + wander_n(hand) <= 0.9 * press.overload_n
    return off_n <= 0.9 * press.band_ratio * press.target_n and is_gentle and abs(hand.fade_n_per_s) <= 0.02


def _is_good_ramp(hand: HandSettings, config: Config) -> bool:
    press = config.press
    tremor_n_per_s = LARGEST_TREMOR * hand.tremor_n / STEADY_WINDOW_S
    rate_n_per_s = hand.ramp_rate_n_per_s + tremor_n_per_s + WANDER_PER_S * hand.drift_n
    return rate_n_per_s <= press.max_rate_n_per_s and RAMP_TO_N + 0.04 <= hand.ramp_aim_n <= 0.9 * press.overload_n
