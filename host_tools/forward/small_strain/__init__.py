"""Small strain: linear elasticity, closed sliding contact under a flat face, unilateral contact under a dome.

Modules in reading order: `elasticity`, `contact`, `folding`, `linear_press`, `domed_press`.

Nothing of finite strain.
"""
