"""Networks with which a fit begins: how wide, how many, in which numbers; error on presses nobody has learned from.

The committed ensemble loses members and is written in 8-bit integers (weights and activations, onnxruntime's dynamic
quantisation of the wide products); networks of other widths are trained for a fraction of its budget, so they compete
among themselves. Cost is one call for one press.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import onnx
from onnx import numpy_helper

from device.measurement.arrays import Array, Single
from device.measurement.bundle import open_session
from device.measurement.parameters import denormalise
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.model import RampModel
from host_tools.pages.benchmark import Chapter
from host_tools.press_models.noisy_presses import NetworkPresses, random_press_set
from host_tools.press_models.onnx_networks import build_network
from host_tools.press_models.seeds import derived_seed
from host_tools.press_models.train_ensemble import train_ensemble
from host_tools.tradeoff.fronts import front_figure, front_table, unknown_panels
from host_tools.tradeoff.pareto import Choice, needless_everywhere
from host_tools.tradeoff.yardstick import cost

COMMITTED, INTEGERS, WIDTHS = "committed, float32", "committed, int8", "short training, float32"
TURNS = 15
"""A call takes some 30 us, and its time is noisy."""
STACKED = 3
"""Constants of so many dimensions hold one matrix for each member, in their first one."""


class NetworkBudget(NamedTuple):
    """Presses scored; widths that are trained, with their members, steps and presses."""

    presses: int = 20_000
    widths: tuple[int, ...] = (12, 48, 96, 192)
    members: int = 2
    steps: int = 1_500
    trained_on: int = 40_000


SHORT = NetworkBudget(presses=200, widths=(4, 8), members=1, steps=20, trained_on=1_000)
"""Enough to try the chain."""


class NoisyRows(NamedTuple):
    """Noisy rows [n, F] as networks read them, and the unknowns' true values [n, 3]."""

    rows: Single
    truth: Array


def networks_chapter(
    network: bytes, model: RampModel, budget: NetworkBudget | None = None, *, jobs: int = -1
) -> Chapter:
    """Return the fronts of the networks with which a fit begins; `network` is the ONNX file of `model`."""
    asked = budget or NetworkBudget()
    scored = _scored(_press_set(model, asked.presses, "trade-off of the networks"))
    trained = _trained(_press_set(model, asked.trained_on, "short training"), asked, scored, jobs)
    panels = unknown_panels(_committed(network, scored)) + unknown_panels(trained, ", short training")
    return Chapter(
        "Networks with which a fit begins",
        f"{asked.presses} random presses of the surrogate with every drift; one call of the networks for one press.",
        "host_tools/tradeoff/press_networks.py",
        tables=(front_table("Every network", panels),),
        figures=(
            front_figure("tradeoff_networks.svg", "Time and error of the networks with which a fit begins", panels),
        ),
        facts={
            "needless": needless_everywhere([panel.choices for panel in panels]),
            "members": members_of(network),
            "steps": asked.steps,
            "trained_on": asked.trained_on,
        },
    )


Choices = Sequence[Choice]
"""One network's point for each unknown."""


def _committed(network: bytes, scored: NoisyRows) -> list[Choices]:
    """Return the committed ensemble, by its members and in integers."""
    whole = members_of(network)
    fewer = {n: with_members(network, n) for n in range(1, whole + 1)}
    exact = [_points(f"{n}", COMMITTED, some, scored, chosen=n == whole) for n, some in fewer.items()]
    return exact + [_points(f"{n} int8", INTEGERS, in_integers(fewer[n]), scored) for n in (1, whole)]


def _trained(training_set: NetworkPresses, asked: NetworkBudget, scored: NoisyRows, jobs: int) -> list[Choices]:
    """Return networks of every width, trained for a short while."""
    networks = {
        width: train_ensemble(training_set, seed=2, members=asked.members, steps=asked.steps, hidden=width, jobs=jobs)
        for width in asked.widths
    }
    return [
        _points(f"{asked.members} of {width}", WIDTHS, build_network(trained), scored)
        for width, trained in networks.items()
    ]


def _press_set(model: RampModel, count: int, purpose: str) -> NetworkPresses:
    answers = model.answers
    return NetworkPresses(random_press_set(answers.surrogate, answers.noise, count, derived_seed(2, purpose)))


def _scored(presses: NetworkPresses) -> NoisyRows:
    rng = np.random.default_rng(derived_seed(2, "noise on the trade-off of the networks"))
    rows = presses.noisy(np.arange(len(presses.rows)), rng)
    return NoisyRows(rows, denormalise(presses.normalised.astype(np.float64))[:, : len(UNKNOWNS)])


def _points(name: str, family: str, network: bytes, scored: NoisyRows, *, chosen: bool = False) -> Choices:
    """Return a network's point for each unknown."""
    session = open_session(network)
    (found,) = session.run(["estimate"], {"features": scored.rows})
    percent = 100 * np.median(np.abs(found / scored.truth - 1), axis=0)
    row = scored.rows[:1]
    takes = cost(lambda: session.run(["estimate", "spread"], {"features": row}), TURNS)
    return [Choice(name, family, takes.yardsticks, float(error), chosen=chosen) for error in percent]


def members_of(network: bytes) -> int:
    """Return how many members an exported ensemble has."""
    constants = onnx.load_from_string(network).graph.initializer
    return min(int(constant.dims[0]) for constant in constants if len(constant.dims) == STACKED)


def with_members(network: bytes, count: int) -> bytes:
    """Return an exported ensemble with its first members alone."""
    model = onnx.load_from_string(network)
    for constant in model.graph.initializer:
        if len(constant.dims) == STACKED:
            some = numpy_helper.to_array(constant)[:count]
            constant.CopyFrom(numpy_helper.from_array(np.ascontiguousarray(some), constant.name))
    return bytes(model.SerializeToString())


def in_integers(network: bytes) -> bytes:
    """Return an exported ensemble whose members' products are of 8-bit integers, scales taken from each input."""
    from onnxruntime.quantization import QuantType, quantize_dynamic

    model = onnx.load_from_string(network)
    stacked = {constant.name for constant in model.graph.initializer if len(constant.dims) == STACKED}
    for number, node in enumerate(model.graph.node):
        node.name = f"{node.op_type}_{number}"
    products = [node.name for node in model.graph.node if node.op_type == "MatMul" and stacked & set(node.input)]
    with tempfile.TemporaryDirectory(prefix="tsis-int8-") as folder:
        out = Path(folder, "int8.onnx")
        quantize_dynamic(model, out, nodes_to_quantize=products, weight_type=QuantType.QInt8)
        return out.read_bytes()
