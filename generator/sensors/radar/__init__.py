"""Radars: detections, cross sections, and devices as data."""
