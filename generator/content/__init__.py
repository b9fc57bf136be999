"""Content: families of assets and packs.

The core imports none of its modules; it reads the tables below.
"""

from __future__ import annotations

FAMILIES = (
    "gen_data.generator.assets.procedural",
    "gen_data.generator.assets.roads",
    "gen_data.generator.assets.scenery",
    "gen_data.generator.assets.vehicles",
    "gen_data.generator.assets.people",
    "gen_data.generator.assets.interiors",
    "gen_data.generator.assets.skies",
)
"""Packages with tables ``FAMILIES``, ``TEXTURES`` or ``ENVIRONMENTS``."""
PACKS = "gen_data.generator.packs"
"""Package of ``packs.yaml``."""
ROAD_NETWORK = "gen_data.generator.assets.roads.network_surface:network_solid"
"""Function that builds the surface of a road network."""
USE_MARKS = "gen_data.generator.assets.procedural.textures.use_marks:use"
"""Function that marks a worn object: ``marks`` in the rows of families."""
