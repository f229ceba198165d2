"""What stands between another machine and the routes: the port, patience with a connection, who asks, and the log.

Modules in reading order: `network`, `certificate_watch`, `counted_port`, `connection`, `door`, `open_answers`,
`request_line`.
"""
