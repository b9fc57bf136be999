"""Laser scanners: scan patterns, detection, atmosphere, motion distortion, presets."""
