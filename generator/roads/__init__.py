"""Roads as geometry: reference lines, cross sections, lane graphs, OpenDRIVE files."""
