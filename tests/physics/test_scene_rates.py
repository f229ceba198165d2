"""The real scene is singular at both rims: grading the elements to them is what makes its force accurate."""

from host_tools.verification import scene_rates


def test_grading_to_both_rims_beats_a_uniform_mesh_tenfold():
    reference = scene_rates.solve_level(*scene_rates.REFERENCE).features
    found = scene_rates.measurements(orders=(3,), sizes_mm=(2.0,))
    uniform, graded = (scene_rates.errors(found[kind, 3], reference)[0] for kind in ("uniform", "graded"))
    assert graded.force < uniform.force / 10
    assert graded.force < 1e-3
