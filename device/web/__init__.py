"""REST, events and the device's screen: what a hospital PC calls and what the operator sees.

Modules in reading order: `server`, `network`, `connection`, `app`, `guard`, `door`,
`open_answers`, `request_line`, `schema`, `contract`, `exams`, `events`,
`kept_files`, `updates`, `pairing`, `problems`.

Handlers look up and answer: no measuring, no hardware, no decisions.
"""
