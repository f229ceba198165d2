"""The paper's protocol, repeated to the letter, and what it was worth.

Modules in reading order: `networks`, `protocol`, `study`, `side_by_side`, `page`.

Nothing that ships: only `host_tools.commands.paper` imports this room.
"""
