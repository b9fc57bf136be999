"""Laser scanners as data: one YAML file each, with its sources."""
