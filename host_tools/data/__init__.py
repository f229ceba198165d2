"""Data sets: one row a scene, resumable, failures kept.

Modules in reading order: `plan`, `rows`, `executors`, `journal`, `dataset_file`, `sweep`, `dataset`,
`exported`.

No model of the probe: a row is what the solver said, and `dataset` hands it to the paper's network.
"""
