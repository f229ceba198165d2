"""The paper's network: 3-10-4-3, trained by scaled conjugate gradients, exported as one bundle.

Modules in reading order: `network`, `scaled_conjugate_gradient`, `levenberg_marquardt`, `train`, `evaluate`,
`export_refused`, `export`.

Nothing of the other modes.
"""
