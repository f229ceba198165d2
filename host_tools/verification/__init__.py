"""Does the program solve its equations? The forward model against answers known on paper, and against another program.

Modules in reading order: `elastic`, `patch`, `rates`, `hertz`, `hayes`, `eshelby`, `incompressible`, `balance`,
`symmetries`, `smoothness`, `scene_rates`, `mechanics`, `extremes`, `truths`, `tolerances`, `effectivity`,
`chapters`.

Rooms: `light` (the same for the optics), `cross_check` (other programs solve the same).
Measured here, bounded in tests/physics.
"""
