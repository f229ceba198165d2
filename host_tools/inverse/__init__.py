"""The inverse map of the toolkit: features of a press to size, depth and Young's modulus."""
