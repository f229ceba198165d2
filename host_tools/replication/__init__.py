"""The paper's protocol, repeated to the letter, and what it was worth.

Modules in reading order: `networks`, `protocol`, `study`, `side_by_side`, `chapters`, `methods_chapter`, `verdict`,
`feature_sensitivity`, `feature_reading`, `feature_page`.

Nothing that ships: no product module imports this room.
"""
