"""The scene on the device: packing, materials, textures, lights and bounding volume hierarchies."""
