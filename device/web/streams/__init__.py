"""What is told while it happens, to as many clients as listen: changes of the store, and what the camera sees.

Modules in reading order: `changes`, `live_view`.

Nothing is read while nothing happens, and who does not read costs no more than his last message.
"""
