"""The verbs of the command line, one file each or a few that belong together.

Modules in reading order: `simulate`, `sweep`, `train`, `evaluate`, `probe`, `calibrate`, `commission`, `model`,
`worlds`, `limits`, `modes`, `tradeoff`, `optics`, `verify`, `paper`, `release`, `measured_chapters`, `output`.

Options, progress and printing only; heavy imports stand inside the verb, so that `--help` is at once.
"""
