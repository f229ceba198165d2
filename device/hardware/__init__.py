"""Drivers: the only folder that imports smbus2, picamera2 and serial."""
