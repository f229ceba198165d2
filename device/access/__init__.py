"""Who may ask for what: rules on the request alone, the same for the daemon and for what stands in for it.

Modules in reading order: `known_hosts`, `request_rules`, `safe_headers`, `scopes`, `pairing`,
`pem_file`, `certificate`.

Standard library only, for the stand-in has to run when a release's own packages are broken. No web framework: rules
take what a request says and raise a fault.
"""
