"""Laser scanners: first and secondary hits, and materials in the infrared."""
