"""The verbs of `python -m device`, one file each: options in, exit code out.

Modules in reading order: `serve`, `analyse`, `focus`, `record`, `calibration`, `self_test`, `config`, `faults`,
`pair`, `tokens`, `openapi`, `update`, `backup`, `restore`, `erase`, `support`, `dicom`,
`led_off`.

Those that only look are in `look`. What a verb does stands in the room that does it; here are its options and what it
prints. `led_off` imports neither NumPy nor pydantic before the LEDs are dark.
"""
