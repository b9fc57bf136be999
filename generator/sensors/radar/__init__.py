"""Radars: detection, radar cross sections, presets of devices."""
