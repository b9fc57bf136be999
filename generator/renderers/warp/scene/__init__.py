"""A scene on the device: packing, materials, textures, lights and trees of boxes."""
