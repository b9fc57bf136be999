"""Weather in images: fog, rain, snow and wet ground."""
