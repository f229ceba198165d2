"""The probe's daemon: light, camera and force in; size, depth and Young's modulus out."""

__version__ = "0.1.0"
