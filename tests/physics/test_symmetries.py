"""A quarter of the solid and the meridian plane are the same body."""

from host_tools.verification import symmetries


def test_a_quarter_of_the_solid_is_the_axisymmetric_scene():
    """A coarse 3-D mesh of order 3 is good to a per cent or two."""
    force, O1, O2 = symmetries.benchmarks(symmetries.measurements(("quarter",)))
    assert force.error <= 0.01, force
    assert O1.error <= 0.02, O1
    assert O2.error <= 0.02, O2
