"""The inside of buildings: shells of rooms, furniture, fittings and lamps.

Front +X; origin on the floor at the centre of the footprint. Things that hang have their origin at
the lowest point, in the middle of the back for those on walls.
"""

from gen_data.assets.family import load_families

FAMILIES, TEXTURES, _ = load_families(__name__)
