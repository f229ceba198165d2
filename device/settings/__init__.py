"""The settings of the daemon: what each one is, the files they come from, and the last ones that were good.

Modules in reading order: `layers`, `catalogue`, `named_files`, `last_good`, `plain_light`, `page`.

No part of the probe is opened here.
"""
