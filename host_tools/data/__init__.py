"""Data sets: one row a scene, resumable, failures kept."""
