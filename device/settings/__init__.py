"""The settings of the daemon: what each one is, the files they come from, and the last ones that were good."""
