"""Guard rails, jersey barriers and work-site barriers.

Pieces run along Y and face the traffic of a street with +X; sections of equal length join end to
end.
"""

import numpy as np

from gen_data.assets.family import Facts, Solid, choose_option
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import painted_material, patterned_material
from gen_data.content.procedural.patches import Patch
from gen_data.content.procedural.surface_shapes import block, extrude, grid
from gen_data.content.scenery.basic_shapes import make_solid, post
from gen_data.content.scenery.street_furniture import GALVANISED
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import variant_rng

BARRIERS = ("guard_rail", "jersey", "construction")


def barrier(seed: int, style: str) -> Solid:
    """A barrier section; ``style`` ``any`` leaves the choice to the seed."""
    kind = barrier_facts(seed, style).subcategory
    return {"guard_rail": _guard_rail, "jersey": _jersey}.get(kind, _construction)(seed)


def barrier_facts(seed: int, style: str) -> Facts:
    """Its kind. Raises AssetError for an unknown style."""
    return Facts(choose_option("barrier", "style", style, BARRIERS, seed))


def _guard_rail(seed: int) -> Solid:
    """A W-beam on posts, 4 m long, 0.75 m high (EN 1317 systems)."""
    half = 2.0
    wave = [(0.0, 0.44), (0.05, 0.47), (0.08, 0.5), (0.05, 0.55), (0.0, 0.595),
            (0.05, 0.64), (0.08, 0.69), (0.05, 0.72), (0.0, 0.75)]  # fmt: skip
    rows = np.array([[(0.1 + x, y, z) for y in (-half, half)] for x, z in wave])
    back = np.array([[(0.096 + x, y, z) for y in (half, -half)] for x, z in wave])
    posts = [block((-0.05, y - 0.03, 0.0), (0.05, y + 0.03, 0.72)) for y in (-1.0, 1.0)]
    spacers = [block((0.05, y - 0.05, 0.52), (0.1, y + 0.05, 0.68)) for y in (-1.0, 1.0)]
    hull = hulls.box((-0.05, -half, 0.0), (0.18, half, 0.75))
    parts = [grid(rows), grid(back), *posts, *spacers]
    shade = patterned_material("texture/brushed_metal?seed=1", 1.0, 0.6, (0.62, 0.63, 0.64))
    return make_solid(parts, (shade if seed % 2 else GALVANISED,), [hull])


def _jersey(seed: int) -> Solid:
    """A concrete safety shape, 2 m long: foot 0.6 m, 0.8-0.9 m high."""
    rng = variant_rng("barrier/jersey", seed)
    half, h = 1.0, rng.between(0.8, 0.9, "height_m")
    flank = [(0.0, 0.3), (0.08, 0.3), (0.33, 0.17), (h, 0.09)]
    section = np.array([*((z, -y) for z, y in flank), *flank[::-1]])
    prism = extrude(section, 2 * half, 0.008).rotated("y", -0.5 * np.pi)
    # The section's first axis has become Z, the extrusion runs along -X: turn it to Y.
    lying = prism.rotated("z", 0.5 * np.pi)
    low, high = lying.bounds_m()
    x, y, _ = (0.5 * (low + high)).tolist()
    body = lying.moved(-x, -y, -float(low[2]))
    concrete = patterned_material("texture/concrete?seed=3", 2.0, 0.92, (0.95, 0.94, 0.92))
    return make_solid([body], (concrete,), [hulls.extreme(body.corners_m, 32)])


def _construction(seed: int) -> Solid:
    """A work-site barrier: a red and white board on two feet, lamps on some."""
    rng = variant_rng("barrier/construction", seed)
    half, z, fields = 0.5 * rng.between(1.2, 2.0, "width_m"), 0.85, 8
    boards = []
    for low in ((z, z + 0.2), (0.25, 0.35))[: rng.choose((1, 2, 2))]:
        boards += _striped_board(half, low, fields)
    ends = (-half + 0.15, half - 0.15)
    legs = [block((-0.02, y - 0.02, 0.05), (0.01, y + 0.02, 1.1), slot=2) for y in ends]
    feet = [block((-0.4, y - 0.13, 0.0), (0.4, y + 0.13, 0.1), 0.01, 3) for y in ends]
    lamps = [post(0.075, (1.1, 1.26), (0.0, y, 0.0), 12).painted(4) for y in ends]
    parts = [*boards, *legs, *feet, *(lamps if seed % 2 else ())]
    slots = (
        painted_material("#b9261c", 0.4),
        painted_material("#e8e7e2", 0.4),
        GALVANISED,
        painted_material("#242526", 0.85),
        Material((0.85, 0.42, 0.05), roughness=0.2, role="lamp"),
    )
    return make_solid(parts, slots, [hulls.box((-0.4, -half, 0.0), (0.4, half, z + 0.2))])


def _striped_board(half: float, z_m: tuple[float, float], fields: int) -> list[Patch]:
    """A board of slanted red and white fields; slots 0 and 1, its back is white."""
    (z0, z1), step = z_m, 2 * half / fields
    lean = 0.35 * step
    board = block((0.012, -half, z0), (0.03, half, z1), slot=1)
    x, stripes = 0.032, []
    for k in range(0, fields, 2):
        a, b = -half + k * step, -half + (k + 1) * step
        corners = np.array([[(x, a, z0), (x, b, z0)], [(x, a + lean, z1), (x, b + lean, z1)]])
        stripes.append(grid(np.clip(corners, None, np.array([1.0, half, 2.0]))))
    return [board, *stripes]
