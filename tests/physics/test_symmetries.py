"""A quarter of the solid and the meridian plane are the same body."""

from host_tools.verification import symmetries


def test_a_quarter_of_the_solid_is_the_axisymmetric_scene():
    for benchmark in symmetries.benchmarks(symmetries.measurements(("quarter",))):
        assert benchmark.passed, benchmark
