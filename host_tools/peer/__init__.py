"""Independent checks of the forward model: the same scene solved by another program."""
