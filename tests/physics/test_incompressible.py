"""The incompressible limit: with a pressure of its own the solution settles, displacements of order 1 lock."""

from host_tools.verification import incompressible
from host_tools.verification.incompressible import Formulation


def test_the_mixed_formulation_settles_where_displacements_lock():
    found = incompressible.measurements((Formulation(1, mixed=False), Formulation(3, mixed=True)))
    w0, force, locked = incompressible.benchmarks(found)
    assert w0.error <= 1e-5, w0
    assert force.error <= 1e-5, force
    assert locked.measured >= 10.0, locked
