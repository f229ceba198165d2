"""A line for each thing, a mark for each mode that answers, and nothing where none does."""

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt
from told_answers import told_presses

from host_tools.scores.one_thing.cost_figure import PANELS, cost_figure


def test_every_thing_has_a_line_and_refused_ones_only_their_share():
    found = {"standard": [told_presses(3, wrong=1), told_presses(0, refused=4)], "quick": [told_presses(4)] * 2}
    figure = cost_figure("one.svg", ["nothing", "tilt"], found, (0.86, 0.95))
    canvas = plt.figure(figsize=figure.size_in)
    figure.draw(canvas)
    assert [axes.get_xlabel() for axes in canvas.axes] == list(PANELS)
    assert [label.get_text() for label in canvas.axes[0].get_yticklabels()] == ["nothing", "tilt"]
    marks = [axes.get_lines()[0].get_xdata() for axes in canvas.axes]
    np.testing.assert_allclose(marks, [[1.5, np.nan], [0.0, np.nan], [75.0, np.nan], [100.0, 0.0]], atol=1e-9)
    plt.close(canvas)
