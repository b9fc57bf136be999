"""Depth cameras: one module per principle, one YAML file with sources per device."""
