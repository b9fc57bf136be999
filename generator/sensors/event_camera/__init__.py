"""Event cameras: the sensor and its pixels."""
