"""How anything leaves the probe by itself: by a thread that goes on trying, and never while the probe is busy.

Modules in reading order: `persistent_sender`, `tls_failure`.

What is sent, and to whom, is not known here: what is to be sent lies on the disk.
"""
