"""Scenery of streets: buildings, plants, street furniture, traffic lights and signs."""

from gen_data.assets.family import load_families

FAMILIES, TEXTURES, _ = load_families(__name__)
