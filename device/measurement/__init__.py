"""What a press means: numbers in, numbers out. Shared with the workstation.

Modules in reading order: `quantities`, `arrays`, `mode`, `parameters`, `model_card`, `calibration`,
`confidence_belt`, `estimate`, `interval_estimate`, `mode_models`, `radial_gaussian`, `shape_features`.

Rooms: `recording` (frames to a corrected image), `paper_mode`, `ramp_modes` (standard and precise), `quick_mode`. It
imports nothing else of ours.
"""
