"""What CalculiX 2.20 prints, read back."""

from __future__ import annotations

import pytest

from host_tools.verification.cross_check.calculix import Printed, UnreadableOutput, parse_dat

TRANSCRIPT = """
 displacements (vx,vy,vz) for set RAY and time  0.4000000E+01

         1  0.000000E+00  0.000000E+00 -8.820466E-01
       704  1.962407E-01  0.000000E+00 -7.228431E-01

 total force (fx,fy,fz) for set BACK and time  0.4000000E+01

       -2.674756E+00 -3.521383E-01 -8.020005E+00

 displacements (vx,vy,vz) for set RAY and time  0.8000000E+01

         1  0.000000E+00  0.000000E+00 -2.669552E+00
       704  4.552677E-01  0.000000E+00 -2.220388E+00

 total force (fx,fy,fz) for set BACK and time  0.8000000E+01

       -8.373203E+00 -1.102353E+00 -2.446633E+01
"""


def test_states_are_read_in_order_with_every_node_and_the_force() -> None:
    first, second = parse_dat(TRANSCRIPT)
    assert first == Printed(
        {1: (0.0, 0.0, -0.8820466), 704: (0.1962407, 0.0, -0.7228431)}, (-2.674756, -0.3521383, -8.020005)
    )
    assert second.displacement_mm[704] == (0.4552677, 0.0, -2.220388)
    assert second.force_mn[2] == -24.46633


def test_an_empty_file_holds_no_state() -> None:
    assert parse_dat("") == []


def test_a_displacement_without_its_force_is_refused() -> None:
    with pytest.raises(UnreadableOutput, match="must alternate displacements and total force"):
        parse_dat(TRANSCRIPT[: TRANSCRIPT.rindex(" total force")])


def test_a_block_that_was_cut_short_is_refused() -> None:
    with pytest.raises(UnreadableOutput, match="0 rows"):
        parse_dat(TRANSCRIPT[: TRANSCRIPT.rindex("-8.373203E+00")])


def test_a_row_that_was_cut_short_is_refused() -> None:
    with pytest.raises(UnreadableOutput, match="2 components, but must hold 3"):
        parse_dat(TRANSCRIPT[: TRANSCRIPT.rindex("-2.446633E+01")])
