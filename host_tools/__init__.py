"""The workstation toolkit: finite-element sweeps, training and export of the inverse networks, calibration, scores.

Rooms in the order of a scene: `scenes`, `forward`, `data`, `optics`, `probe_tables`, `calibration`, `paper_network`,
`press_models`, `limits`, `scores`, `verification`, `replication`; `pages` writes documents, `commands` holds the
verbs. From the device it takes `measurement`, `simulation` and `files`.
"""
