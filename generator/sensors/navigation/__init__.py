"""Inertial units, satellite receivers and odometers, and devices as data."""
