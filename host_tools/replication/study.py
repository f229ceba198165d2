"""One data set and one probe to everything that docs/paper_protocol.md says, each part computed once.

The parts are computed when first asked for, so that a chapter's time is that of its own work.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, cached_property

from device.measurement.arrays import Array
from device.measurement.quantities import Bound, require
from device.simulation.virtual_probe import ProbeTables
from host_tools.paper_network.evaluate import ErrorTable
from host_tools.paper_network.train import TrainingRows, require_usable
from host_tools.replication import side_by_side as comparison
from host_tools.replication.networks import OURS, PLAIN, RECIPES, Networks, Scenes
from host_tools.replication.protocol import (
    PRESSES,
    ProtocolStep,
    Views,
    errors,
    require_press,
    single_trial_percent,
    views,
)

LIGHTS = ("linear", "physical")
"""The paper's assumption, a straight line from deformation to light, and traced light."""


class PaperStudy:
    """The paper's protocol on rows of a sweep and the virtual probe; `seeds` trials of each network."""

    def __init__(self, rows: TrainingRows, tables: ProbeTables, *, seeds: int = 100, presses: int = PRESSES) -> None:
        """Raise `InvalidQuantity` for rows that cannot train or are of another force, or fewer than two seeds."""
        require_usable(rows)
        require_press(rows)
        require("seeds", seeds, Bound(2, 10_000, "trials"), "take at least two, for a mean")
        self.tables, self.seeds, self.presses = tables, seeds, presses
        self.excluded_rows = rows.excluded_rows
        self.all = Scenes(rows.features, rows.truth)
        self.nine = rows.phantom_index
        self.phantoms = Scenes(rows.features[self.nine], rows.truth[self.nine])
        self.remaining = self.all.without(self.nine)
        self.views = cache(self._views)
        self.errors = cache(self._errors)

    @cached_property
    def left_one_out(self) -> Sequence[Networks]:
        """The networks of each phantom, trained on all scenes but this one."""
        return [Networks(self.all.without(row), PLAIN, trials=self.seeds) for row in self.nine]

    @cached_property
    def left_nine_out(self) -> dict[str, Sequence[Networks]]:
        """By recipe: the networks that saw none of the nine, the same for each phantom."""
        sets = {recipe.name: Networks(self.remaining, recipe, trials=self.seeds) for recipe in RECIPES}
        return {name: [networks] * len(self.nine) for name, networks in sets.items()}

    def _views(self, light: str) -> Views:
        return views(self.phantoms.truth, self.phantoms.features, light, self.tables, presses=self.presses)

    def _errors(self, light: str, step: ProtocolStep, recipe: str = "") -> ErrorTable:
        """Return the errors of a step; with a recipe's name, of its networks that saw none of the nine."""
        networks = self.left_nine_out[recipe] if recipe else self.left_one_out
        return errors(networks, self.views(light), self.phantoms.truth, step)

    def mean_percent(self, light: str, step: ProtocolStep, recipe: str = "") -> Array:
        """Return the mean relative error [3] of a step in percent."""
        return self.errors(light, step, recipe).totals()["mean"]

    @cached_property
    def single_trial_percent(self) -> Array:
        """Mean relative error [3] of one network in percent, to the letter in linear light."""
        return single_trial_percent(self.left_one_out, self.views("linear"), self.phantoms.truth, ProtocolStep.LETTER)

    @cached_property
    def constant_percent(self) -> Array:
        """Mean relative error [3] of answering the mean of the training scenes, in percent."""
        return comparison.constant_percent(self.remaining, self.phantoms)

    @cached_property
    def side_by_side(self) -> dict[str, dict[str, comparison.Runs]]:
        """By recipe and method: a hundred networks each from the same seeds."""
        return {
            recipe.name: comparison.side_by_side(self.remaining, self.phantoms, recipe, seeds=self.seeds)
            for recipe in (PLAIN, OURS)
        }

    @cached_property
    def ends(self) -> dict[str, comparison.Runs]:
        """By method: where searches for the least mean square end when nothing stops them early."""
        return comparison.to_the_end(self.remaining, self.phantoms, PLAIN, seeds=self.seeds)
