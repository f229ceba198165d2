"""The table of faults, made from the classes of device/errors.py: for documents, the screen and the API."""
