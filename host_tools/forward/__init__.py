"""The forward model: a scene in, the deformed sensing surface, contact pressure and force out.

Modules in reading order: `ladder`, `model_departures`, `solve`, `plan`, `tiers`, `press_model`,
`materials`, `symmetry`, `sampling`, `face_state`, `deformation`, `solution`, `soundness`, `solution_dataset`,
`solution_html`, `face_points`, `plots`.

Rooms: `meshes`, `small_strain`, `finite_strain`, `error_estimates`, `derivatives`. No light, no noise, no network.
"""
