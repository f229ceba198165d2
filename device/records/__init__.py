"""What must never be lost: measurements and presses in SQLite, recordings on disk."""
