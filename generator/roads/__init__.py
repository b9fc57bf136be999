"""Geometry of roads: reference lines, cross sections, lane graphs, OpenDRIVE files."""
