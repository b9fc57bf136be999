"""Generators of the street's own textures: ``function(seed, **parameters) -> TextureData``."""
