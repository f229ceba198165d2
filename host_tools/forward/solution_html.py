"""A solution to what a notebook shows of it: numbers with their stated errors, the plan with its reasons, a figure."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Iterator
from html import escape
from math import isfinite

from host_tools.forward.plan import ModelPlan
from host_tools.forward.plots import png_of
from host_tools.forward.solution import Solution
from host_tools.forward.solution_dataset import unit_of


def solution_html(solution: Solution) -> str:
    """Return the HTML of a solution; the figure is inside it."""
    picture = b64encode(png_of(solution)).decode()
    return "".join(
        (
            _table(("", "value", "unit", "stated error"), _values(solution)),
            _table(("choice", "", "why"), _choices(solution.plan)),
            f'<img src="data:image/png;base64,{picture}" alt="deformation and pressure of the face">',
        )
    )


def _values(solution: Solution) -> Iterator[tuple[str, ...]]:
    for name, value in solution.as_record().items():
        if isinstance(value, float):
            error = solution.stated_error.get(name)
            yield name, f"{value:.6g}", unit_of(name), _known(error)


def _known(error: float | None) -> str:
    if error is None:
        return ""
    return f"{100 * error:.2g} %" if isfinite(error) else "unknown"


def _choices(plan: ModelPlan) -> Iterator[tuple[str, ...]]:
    record = plan.as_record() | {"level": f"{plan.grading}, order {plan.order}"}
    return ((choice, str(record[choice]), reason) for choice, reason in plan.reasons.items())


def _table(header: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
