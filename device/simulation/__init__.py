"""The virtual probe: one scene drives light, image and force."""
