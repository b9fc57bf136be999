"""Laser scanners: scan pattern, detection, atmosphere, and devices as data."""
