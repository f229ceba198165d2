"""Render one Mitsuba scene to an array file. Run by path in an interpreter that has Mitsuba and nothing of ours.

Arguments: scene, output (.npy), variant, passes, samples per pixel and pass. The array is [pass, row, column].
"""

from __future__ import annotations

import sys

import mitsuba
import numpy as np


def main(scene_file: str, out: str, variant: str, passes: str, samples: str) -> None:
    """Render independent passes and save them all: their scatter is the noise."""
    mitsuba.set_variant(variant)
    scene = mitsuba.load_file(scene_file)
    images = [np.array(mitsuba.render(scene, spp=int(samples), seed=seed))[:, :, 0] for seed in range(int(passes))]
    np.save(out, np.array(images))


if __name__ == "__main__":
    main(*sys.argv[1:])
