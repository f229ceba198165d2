"""The forward model: a scene in, the deformed sensing surface, contact pressure and force out."""
