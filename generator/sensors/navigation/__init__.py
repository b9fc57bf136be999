"""Inertial measurement units, GNSS receivers and odometers, with presets of devices."""
