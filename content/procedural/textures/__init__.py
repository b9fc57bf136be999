"""Generators of textures: ``function(seed) -> TextureData``, 512 x 512 unless said otherwise.

Surface textures tile in both directions; the docstring of each names the length of one repeat at
which it has its natural size.
"""
