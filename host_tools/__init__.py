"""The workstation toolkit: finite-element sweeps, training and export of the inverse network, calibration, scores."""
