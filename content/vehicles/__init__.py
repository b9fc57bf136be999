"""Cars, vans, trucks, buses, motorcycles and bicycles."""

from gen_data.assets.family import load_families

FAMILIES, TEXTURES, _ = load_families(__name__)
