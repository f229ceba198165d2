"""What is told while it happens, to as many clients as listen: whatever is made or changed in the store.

Modules in reading order: `changes`.

Nothing is read while nothing happens, and who does not read costs no more than his last message.
"""
