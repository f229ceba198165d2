"""Mode paper, the method of Lee & Won: three features of an image, three regressions, one network of 99 weights.

Modules in reading order: `features`, `intervals`, `trained_press`, `lines`, `estimate`.

Nothing of the other modes.
"""
