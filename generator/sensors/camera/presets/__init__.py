"""Cameras as data: one YAML file each, with the sources of its values."""
