"""REST, events and the device's screen: what a hospital PC calls and what the operator sees.

Modules in reading order: `server`, `app`, `guard`, `conditional`, `schema`, `contract`, `paging`, `exams`,
`presses`, `measurements`, `events`, `kept_files`, `exports`, `dicom`, `updates`, `pairing`, `problems`.

What stands before them is `entrance`; the screen's own files are `screen`.

Handlers look up and answer: no measuring, no hardware, no decisions.
"""
