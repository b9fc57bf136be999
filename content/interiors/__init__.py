"""The inside of buildings: shells of rooms, furniture, fittings and lamps.

Front +X; origin on the floor at the centre of the footprint. Suspended objects have their origin at
the lowest point; wall-mounted objects at the lowest point of the middle of the back.
"""

from gen_data.assets.family import load_families

FAMILIES, TEXTURES, _ = load_families(__name__)
