"""Shipped configurations: ``gen-data --config tabletop.yaml`` finds them from any folder."""
