"""Content: families of assets and packs.

The core imports none of its modules; it reads the tables below.
"""

FAMILIES = (
    "gen_data.content.procedural",
    "gen_data.content.roads",
    "gen_data.content.scenery",
    "gen_data.content.vehicles",
    "gen_data.content.people",
    "gen_data.content.interiors",
    "gen_data.content.skies",
)
"""Packages with tables ``FAMILIES``, ``TEXTURES`` or ``ENVIRONMENTS``."""
PACKS = "gen_data.content.packs"
"""Package of ``packs.yaml``."""
ROAD_NETWORK = "gen_data.content.roads.network_surface:network_solid"
"""Function that builds the surface of a road network."""
USE_MARKS = "gen_data.content.procedural.textures.use_marks:use"
"""Function that marks a worn object: ``marks`` in the rows of families."""
BOUNDS = "bounds.npy"
"""File of the bounds of objects, next to this one; ``python -m tests.contracts.asset_bounds``."""
