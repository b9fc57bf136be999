"""Depth cameras: one file per principle, and devices as data, one YAML file each with sources."""
