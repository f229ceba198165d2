"""The forward model: a scene in, the deformed sensing surface, contact pressure and force out.

Modules in reading order: `solve`, `plan`, `accuracy`, `tiers`, `press_model`, `materials`, `symmetry`, `sampling`,
`face_state`, `deformation`, `stated_error`, `solution`, `soundness`, `solution_dataset`,
`solution_html`, `face_points`, `plots`.

Rooms: `meshes`, `small_strain`, `finite_strain`, `derivatives`. No light, no noise, no network.
"""
