"""Finite strain: neo-Hookean tissue that slides along the face, followed over a path of loads.

Modules in reading order: `hyperelasticity`, `closed_contact`, `newton`, `body_energy`, `sliding`, `loaded_face`,
`equilibrium_path`, `load_path`.

Derivatives by the scene stand next door.
"""
