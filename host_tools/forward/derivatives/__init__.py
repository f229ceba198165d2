"""How a press changes with everything that is not exactly known, from its equilibrium and not from differences.

Modules in reading order: `equilibrium`, `mesh_velocity`, `form_action`, `sliding_parts`, `sensitivity`,
`sensitive_presses`.

Only `host_tools.cramer_rao` reads them.
"""
