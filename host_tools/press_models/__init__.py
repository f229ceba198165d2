"""The models of modes quick, standard and precise: random presses to a surrogate, networks and confidence belts.

Modules in reading order: `seeds`, `press_samples`, `recorded_presses`, `fit_surrogate`, `measured_noise`,
`noisy_presses`, `dense_network`, `train_ensemble`, `train_range`, `mode_outcome`, `mode_statistics`,
`confidence_belts`, `ramp_training`, `quick_training`, `onnx_networks`, `export`, `judge_bundle`,
`press_derivatives`.

What the probe computes stands in `device.measurement`; here is only what it learned from.
"""
