"""Every mode's answers to the same presses: as it ships, and by what allows for a probe of one's own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from device import __version__
from device.files.bundle_file import read_quick_model
from device.measurement.arrays import Array
from device.measurement.confidence_belt import ends_in_belts
from device.measurement.estimate import outside_training
from device.measurement.mode import Mode
from device.measurement.parameters import normalise, normalise_unknowns
from device.measurement.quantities import UNKNOWNS
from device.measurement.quick_mode.model import SEEN_BY, QuickModel, visible_contrast
from device.measurement.quick_mode.profile import QuickPress
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.measurement.ramp_modes.commissioned.row_derivatives import RowDerivatives
from device.measurement.ramp_modes.model import RAMP_MODES, CriticalValues, RampModel
from device.measurement.recording.ring_means import RINGS
from device.simulation.virtual_probe import ProbeTables
from host_tools.commissioning.commission import limits
from host_tools.commissioning.joint_fit import Design, fit_probe
from host_tools.commissioning.left_out import answers_of
from host_tools.commissioning.own_quick import train_own_quick
from host_tools.press_models.export import export_quick
from host_tools.press_models.mode_outcome import EvaluatedPresses
from host_tools.press_models.quick_training import QuickBudget
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed
from host_tools.scenes.phantom_set import PhantomSet
from host_tools.scores.foreign_presses import foreign_phantoms
from host_tools.scores.one_thing.causes import Cause
from host_tools.scores.one_thing.tried_presses import TriedPresses
from host_tools.scores.scored_presses import ScoredPresses, scored, tolerant

SHIPPED, TOLERANT, COMMISSIONED = "as it ships", "tolerances", "commissioned"
FEW = {"standard": 10, "precise": 4}
"""As it ships most is refused, which so many presses and scans show."""


class DesignToTry(NamedTuple):
    """The design's bundles of all modes, its derivatives, and the simulated probe's tables."""

    model: RampModel
    quick: QuickModel
    derivatives: RowDerivatives
    tables: ProbeTables

    @property
    def shared(self) -> Design:
        """What commissioning starts from."""
        return Design(self.model.answers, self.derivatives)


class OwnLimits(NamedTuple):
    """What answers presses of a probe of one's own, and above what they are refused."""

    answers: OwnAnswers
    critical: Mapping[Mode, CriticalValues]


def with_tolerances(design: DesignToTry, seed: int) -> OwnLimits:
    """Return what answers presses of a probe that has not been commissioned."""
    answers = tolerant(design.shared)
    return OwnLimits(answers, limits(answers, design.model, seed))


def commissioned(
    design: DesignToTry, causes: Sequence[Cause], phantoms: PhantomSet, seed: int, jobs: int
) -> list[OwnLimits]:
    """Return the same of probes that are commissioned, each on ramps of its own on the phantoms."""
    noise = design.model.answers.noise

    def own(number: int) -> OwnLimits:
        of_phantoms = derived_seed(seed, "phantoms of one thing at a time")
        probe = causes[number].probe
        ramps = foreign_phantoms(design.tables, probe, noise, phantoms, seed=of_phantoms, jobs=1)
        answers = answers_of(design.shared, fit_probe(ramps, design.shared))
        return OwnLimits(answers, limits(answers, design.model, seed))

    return in_parallel(own, len(causes), jobs)


def quick_with_tolerances(design: DesignToTry, seed: int, jobs: int) -> QuickModel:
    """Return mode quick as `commission` trains it, of a probe of which only the builder's tolerances are known."""
    return own_quick_model(design, tolerant(design.shared), seed, jobs=jobs)


def own_quick_model(
    design: DesignToTry, answers: OwnAnswers, seed: int, *, jobs: int, budget: QuickBudget | None = None
) -> QuickModel:
    """Return mode quick of the probe that `answers` are of, as `commission` trains it."""
    own = train_own_quick(answers, design.tables, design.quick.bundle, budget=budget, seed=seed, jobs=jobs)
    with TemporaryDirectory(prefix="tsis-") as folder:
        bundle = Path(folder) / "own"
        export_quick(
            own.trained,
            bundle,
            surrogate_sha256=design.model.bundle.card["surrogate_sha256"],
            serials=(),
            software_version=__version__,
            training_command="",
        )
        return read_quick_model(bundle)


def ramp_scores(tried: TriedPresses, design: DesignToTry, own: OwnLimits, jobs: int) -> dict[str, ScoredPresses]:
    """Return standard and precise, "... as it ships" of the first presses and "... after" of all."""
    found, model = {}, design.model
    for mode, taken in zip(RAMP_MODES, (tried.single, tried.scans), strict=True):
        few = taken.first(FEW[mode])
        found[f"{mode} {SHIPPED}"] = scored(model.answers, model, model.critical[mode], few, jobs)
        found[f"{mode} after"] = scored(own.answers, model, own.critical[mode], taken, jobs)
    return found


def quick_scores(parameters: Array, held: Sequence[QuickPress], model: QuickModel) -> ScoredPresses:
    """Return the answers of mode quick to held presses, as if it had been trained for their probe."""
    shown = [number for number, one in enumerate(held) if _shows(one.row, model)]
    rows = np.array([held[number].row for number in shown]).reshape(len(shown), len(model.bundle.feature_names))
    raw = model.bundle.estimate(rows)
    mean = normalise_unknowns(raw.estimate)
    ends = [ends_in_belts(at, spread, model.belts) for at, spread in zip(mean, raw.spread, strict=True)]
    low, high, known = (np.array([one[part] for one in ends]).reshape(mean.shape) for part in range(3))
    truth = normalise(parameters[shown])[:, : len(UNKNOWNS)]
    answered = [_is_usual(held[number], model) for number in shown]
    nothing, number = np.full(len(shown), np.nan), np.array(shown, int)
    evaluated, all_stand_out = EvaluatedPresses(truth, mean, low, high, known), np.ones(len(shown), bool)
    return ScoredPresses(evaluated, nothing, all_stand_out, np.array(answered, bool), number)


def has_quick_numbers(press: QuickPress, model: QuickModel) -> bool:
    """Return whether mode quick gives numbers, as if it had been trained for the press's probe."""
    return _shows(press.row, model) and _is_usual(press, model)


def _is_usual(press: QuickPress, model: QuickModel) -> bool:
    return press.elongation_ratio <= model.elongation_ratio and not outside_training(model.bundle, press.row)


def _shows(row: Array, model: QuickModel) -> bool:
    seen = visible_contrast(row[:RINGS])
    return any(seen[name] > model.faintest_contrast[name] for name in SEEN_BY)
