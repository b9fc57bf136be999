"""Retaining walls: the cut face of a slope along a road, with the ground that they hold.

Sections run along Y, face the road with +X and join end to end. The wall leans back by a tenth of
its height, as stacked walls do (FHWA-NHI-10-024, chapter 2: batter of modular walls), and the
ground behind rises further and ends in a slope of 1 : 1.5, the usual one of earthworks (RAS-Q).
Walls from 1 m up have a railing (Musterbauordnung, section 38).
"""

import numpy as np

from gen_data.assets.family import Facts, Solid, choose_option
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import painted_material, patterned_material
from gen_data.content.procedural.patches import Patch
from gen_data.content.procedural.surface_shapes import block, extrude
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.content.scenery.clutter_shapes import bar
from gen_data.content.scenery.street_furniture import GALVANISED
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, variant_rng

WALLS = ("stone", "concrete", "gabion", "block", "rendered")
HALF_M = 1.5
"""Half the length of a section."""
_RAIL_FROM_M, _RAIL_M = 1.0, 1.0
"""Height of a wall from which on it has a railing, and the height of that."""
_BATTER, _BACK_SLOPE = 0.1, 1.0 / 1.5
_TOE_M = 0.05
"""The front of the foot: the origin is under the wall."""


def retaining_wall(seed: int, style: str) -> Solid:
    """A section of 3 m; ``style`` ``any`` leaves the choice to the seed."""
    kind = retaining_wall_facts(seed, style).subcategory
    rng = variant_rng(f"retaining_wall/{kind}", seed)
    high, thick = rng.between(0.6, 1.8, "height_m"), rng.between(0.25, 0.4, "thickness_m")
    lean = 0.0 if kind in ("concrete", "rendered") else _BATTER * high
    wall = _along_y([(0.0, 0.0), (-lean, high), (-lean - thick, high), (-lean - thick, 0.0)], 0.012)
    behind = -lean - thick
    rise, shelf = rng.between(0.1, 0.5, "rise_m"), rng.between(1.0, 1.8, "shelf_m")
    soil = high - 0.06
    foot = behind - shelf - (soil + rise) / _BACK_SLOPE
    ground = [(behind, 0.0), (behind, soil), (behind - shelf, soil + rise), (foot, 0.0)]
    parts = [wall, _along_y(ground).painted(1), *_coping(kind, -lean, thick, high)]
    if high >= _RAIL_FROM_M:
        parts += _railing(-lean - 0.5 * thick, high)
    grass = Material(roughness=0.95, texture=f"texture/grass?seed={seed % 4}", role="grass")
    metal = painted_material("#3b3d3f", 0.45) if rng.chance(0.5, "painted") else GALVANISED
    stone = patterned_material("texture/concrete?seed=3", 1.5, 0.9, (0.86, 0.84, 0.8))
    edge = [(x + _TOE_M, y, z) for x, z in ground for y in (-HALF_M, HALF_M)]
    hull = hulls.box((behind + _TOE_M, -HALF_M, 0.0), (_TOE_M, HALF_M, high))
    skins = (_skin(kind, rng), grass, stone, metal)
    return make_solid([part.moved(_TOE_M) for part in parts], skins, [hull, np.array(edge)])


def retaining_wall_facts(seed: int, style: str) -> Facts:
    """Its kind. Raises AssetError for an unknown style."""
    return Facts(choose_option("retaining_wall", "style", style, WALLS, seed))


def _along_y(section: list[tuple[float, float]], bevel_m: float = 0.0) -> Patch:
    """A prism along Y of a section in x and z."""
    outline = np.array([(x, z) for x, z in section])
    return extrude(outline, 2.0 * HALF_M, bevel_m).rotated("x", 0.5 * np.pi).moved(y=HALF_M)


def _coping(kind: str, front: float, thick: float, high: float) -> list[Patch]:
    """Slabs on the wall that reach over its front; slot 2. Gabions and blocks have none."""
    if kind in ("gabion", "block"):
        return []
    low = (front - thick - 0.02, -HALF_M, high)
    return [block(low, (front + 0.04, HALF_M, high + 0.07), 0.012, 2)]


def _railing(x: float, foot: float) -> list[Patch]:
    """Two posts and three rails; slot 3."""
    top = foot + _RAIL_M
    posts = [bar((x, y, foot), (x, y, top), 0.022, 8, 3) for y in (-0.75, 0.75)]
    heights = (foot + 0.4, foot + 0.7, top)
    return posts + [bar((x, -HALF_M, z), (x, HALF_M, z), 0.02, 8, 3) for z in heights]


def _skin(kind: str, rng: VariantRng) -> Material:
    """Material of the wall."""
    if kind == "stone":
        shade = rng.choose(((0.5, 0.48, 0.44), (0.62, 0.54, 0.42), (0.36, 0.37, 0.38)))
        return patterned_material("texture/ashlar?seed=1", 1.3, 0.93, shade)
    if kind == "gabion":
        return patterned_material("texture/ashlar?seed=2", 0.55, 0.95, (0.42, 0.41, 0.39))
    if kind == "block":
        shade = rng.choose(((0.62, 0.6, 0.56), (0.7, 0.55, 0.42)))
        return patterned_material("texture/ashlar?seed=0", 0.9, 0.93, shade)
    if kind == "rendered":
        shade = rng.choose(((0.72, 0.7, 0.64), (0.66, 0.56, 0.42), (0.78, 0.78, 0.76)))
        return patterned_material("texture/plaster?seed=5", 2.5, 0.92, shade)
    return patterned_material("texture/concrete?seed=3", 2.5, 0.92, (0.8, 0.79, 0.76))
