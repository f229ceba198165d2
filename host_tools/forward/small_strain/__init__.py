"""Small strain: linear elasticity, closed sliding contact under a flat face, unilateral contact under a dome.

Modules in reading order: `elasticity`, `contact`, `cores`, `linear_press`, `folding`, `element_residual`,
`linear_model`, `off_axis_inclusion`, `domed_press`.

Nothing of finite strain.
"""
