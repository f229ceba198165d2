"""What docs/modes.md says before and after its chapters."""

from __future__ import annotations

from host_tools.pages.document import Cover

MODES_PAGE = Cover(
    "Modes of a press",
    (
        "How fast and how sure: what the modes of a press answer, measured on the simulated probe with",
        "camera noise and every drift (1 % of light, 1 mN of the cell's zero, 0.2 % of smooth error in the flat field",
        "and again in the forward model) over size 2-15 mm, depth 4-12 mm, 10-160 kPa, tissue 4-6 kPa, slab 27-33 mm,",
        "skin of any albedo, spread and contact law in their ranges, inclusions up to 2 mm off the axis.",
    ),
    (
        "A real probe: truth and model share the same tables; what these get wrong is only allowed for as noise.",
        "Inclusions that are neither spheres nor in a homogeneous slab, other than those of the chapter on refusals.",
        "Times on a Raspberry Pi: they are of the machine that wrote this page.",
    ),
)
