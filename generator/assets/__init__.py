"""Meshes, textures, environments and robots: one library, one normal form, one cache."""
