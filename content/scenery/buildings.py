"""Buildings: a facade grammar over a design.

A building is four walls and a roof. Each wall is split into floors, floors into bays, and every
bay gets an opening with a window, a door or a shop front. Origin: the centre of the walls'
footprint on the ground; the front wall lies at x = depth / 2 and faces +X. Wings, steps, porches,
sills, balconies and awnings reach beyond it, fences to a neighbour beyond the side walls.
"""

import math

import numpy as np
from numpy.typing import NDArray

from gen_data.assets.family import Facts, Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.procedural.surface_shapes import block
from gen_data.content.scenery import building_designs, facade, other_sides, roofs, street_side
from gen_data.content.scenery import facade_fittings as fittings
from gen_data.content.scenery.basic_shapes import Span, make_solid, quad
from gen_data.content.scenery.facade import BASE, DOOR, FACADE, METAL
from gen_data.content.scenery.textures.facade_finish import PLASTER_WIDTH_M
from gen_data.core.asset_types import Keypoint
from gen_data.core.variant_rng import VariantRng, variant_rng

_EAVES_M = 0.45
_LEAF_M = 1.7
"""Leaves of doors are higher; other parts in their colour are not."""


def building(seed: int, style: str, region: str = "any") -> Solid:
    """A building of a style, in colours of a region; see ``facade`` for its material slots.

    Raises:
        AssetError: for an unknown style or region.
    """
    plan = building_designs.draw_design(style, seed)
    materials = building_designs.building_materials(plan, seed, region)
    rng = variant_rng(f"building/{style}/details", seed)
    front = street_side.front(plan, rng)
    wing = street_side.wing_span(plan, front)
    sides = [
        (0.0, front, plan.depth_m),
        (math.pi, other_sides.back(plan, rng), plan.depth_m),
        *((k * 0.5 * math.pi, other_sides.side(plan, rng), plan.width_m) for k in (1, -1)),
    ]
    walls = [
        _map_plaster(wall, plan.eaves_m, rng.random()).moved(0.5 * across).rotated("z", turn)
        for turn, wall, across in sides
    ]
    x, y = 0.5 * plan.depth_m, 0.5 * plan.width_m
    floor = quad([(-x, -y, 0.0), (-x, y, 0.0), (x, y, 0.0), (x, -y, 0.0)], BASE)
    roof = _map_gables(_roof(plan, wing, rng)).moved(z=plan.eaves_m)
    parts = [*walls, floor, roof]
    low, high = (-x, -y, 0.0), (x, y, plan.eaves_m + 0.5)
    boxes = [hulls.box(low, high)]
    if wing is not None:
        parts.append(_wing_roof(plan, wing, rng))
        corner = (x + plan.wing_out_m, wing[1], plan.eaves_m)
        boxes.append(hulls.box((x, wing[0], 0.0), corner))
    if plan.gate_m > 0.0:
        fence = other_sides.gate(plan, rng).moved(x - rng.between(0.0, 2.0), y)
        parts.append(fence if rng.chance(0.5) else _mirrored(fence))
    return make_solid(parts, materials, boxes, _main_door(front, x))


def _main_door(front: Patch, x_m: float) -> list[Keypoint]:
    """Keypoint ``door``: where the middle of the main door meets the ground, if there is one."""
    leaves = front.corners_m[front.slots == DOOR]
    tall = leaves[np.ptp(leaves[..., 2], axis=1) > _LEAF_M] if len(leaves) else leaves
    if not len(tall):
        return []
    middles = 0.5 * (tall[..., 1].min(axis=1) + tall[..., 1].max(axis=1))
    y = float(middles[np.abs(middles).argmin()])
    return [Keypoint("door", (round(x_m, 4), round(y, 4), 0.0), 0.1)]


def building_facts(seed: int, style: str, region: str = "any") -> Facts:
    """Style, number of floors and region, without building it."""
    place = building_designs.choose_region(style, seed, region)
    floors = str(building_designs.draw_design(style, seed).floors)
    return Facts(style, {"floors": floors, "region": place})


def _map_plaster(wall: Patch, top_m: float, shift: float) -> Patch:
    """The wall with the image of its plaster from foot to eaves, starting anywhere along it."""
    y, z = wall.corners_m[..., 1], wall.corners_m[..., 2]
    uvs = np.stack([y / PLASTER_WIDTH_M + shift, z / top_m], axis=2)
    return Patch(wall.corners_m, np.where(_is_wall(wall), uvs, wall.uvs), wall.slots)


def _map_gables(roof: Patch) -> Patch:
    """The roof with the middle of the plaster's image on its gables and parapets."""
    x, y, z = (roof.corners_m[..., k] for k in range(3))
    uvs = np.stack([(x + y) / PLASTER_WIDTH_M, 0.5 + 0.04 * z], axis=2)
    return Patch(roof.corners_m, np.where(_is_wall(roof), uvs, roof.uvs), roof.slots)


def _is_wall(patch: Patch) -> NDArray[np.bool_]:
    walls: NDArray[np.bool_] = patch.slots == FACADE
    return walls[:, None, None]


def _mirrored(patch: Patch) -> Patch:
    """The patch on the other side of the plane y = 0."""
    corners = patch.corners_m * np.array([1.0, -1.0, 1.0])
    return Patch(corners[:, ::-1], patch.uvs[:, ::-1], patch.slots)


def _wing_roof(plan: building_designs.Design, y_m: Span, rng: VariantRng) -> Patch:
    """The roof of a wing: a gable that looks at the street, or a parapet."""
    front, width = 0.5 * plan.depth_m + plan.wing_out_m, y_m[1] - y_m[0]
    middle = 0.5 * (y_m[0] + y_m[1])
    if plan.roof == "flat" or width > plan.depth_m:
        low = (0.5 * plan.depth_m, y_m[0], plan.eaves_m)
        return block(low, (front, y_m[1], plan.eaves_m + rng.between(0.1, 0.5)), slot=METAL)
    pitch = 0.85 * plan.pitch_rad if plan.roof == "hip" else plan.pitch_rad
    profile = roofs.gable_profile(width, pitch, 0.3)
    verge = max(0.15, plan.verge_m)
    shell = _map_gables(roofs.over_profile(profile, front, verge, 0.22))
    # Its back end lies inside the main roof.
    return shell.rotated("z", 0.5 * math.pi).moved(0.5 * front, middle, plan.eaves_m)


def _roof(plan: building_designs.Design, wing: Span | None, rng: VariantRng) -> Patch:
    if plan.roof == "flat":
        return _flat_roof(plan, rng)
    if plan.roof == "hip":
        pitch, depth_m = 0.85 * plan.pitch_rad, min(plan.depth_m, plan.width_m)
        shell = roofs.hip(plan.depth_m, plan.width_m, pitch, 0.32)
        ridge = 0.5 * depth_m * math.tan(pitch)
        stack = roofs.chimney(-0.5, 0.4, (0.6 * ridge, ridge + 0.6))
        return join_patches([shell, stack, *_crown((-0.3, -0.5), ridge, rng)])
    if plan.roof == "mansard":
        rise = rng.between(2.5, 2.9)
        profile = roofs.mansard_profile(plan.depth_m, rise, 0.3)
        slope = 0.36
    else:
        profile = roofs.gable_profile(plan.depth_m, plan.pitch_rad, _EAVES_M)
        slope = 1.0 / math.tan(plan.pitch_rad)
    if plan.gable_front:
        return _gable_front(plan, rng)
    shell = roofs.over_profile(profile, plan.width_m, plan.verge_m, 0.24)
    ridge = max(z for _, z in profile)
    y = rng.between(-0.3, 0.3) * plan.width_m
    stack = roofs.chimney(-0.8, y, (max(0.0, ridge - 1.4), ridge + rng.between(0.5, 0.9)))
    made = [shell, stack, *_dormers(plan, slope, wing, rng), *_crown((-1.0, -y), ridge, rng)]
    if plan.roof == "gable" and plan.dormers == 0 and wing is None:
        made += _on_slope(plan, rng)
    return join_patches(made)


def _flat_roof(plan: building_designs.Design, rng: VariantRng) -> Patch:
    """A deck with stair heads, machinery and aerials."""
    parts = [roofs.flat(plan.depth_m, plan.width_m, rng.between(0.25, 0.9))]
    for _ in range(rng.choose((1, 1, 2, 3))):
        x, y = rng.between(-0.3, 0.15) * plan.depth_m, rng.between(-0.35, 0.35) * plan.width_m
        size_m = (rng.between(1.0, 3.5), rng.between(1.2, 4.0), rng.between(0.9, 2.4))
        slot = rng.choose((METAL, FACADE, facade.CEMENT))
        parts.append(roofs.unit(x, y, size_m).painted(slot))
    if rng.chance(0.5):
        at = rng.between(-0.2, 0.3) * plan.depth_m, rng.between(-0.4, 0.4) * plan.width_m
        parts.append(fittings.aerial(rng).moved(*at, 0.45))
    return join_patches(parts)


def _crown(at_m: tuple[float, float], ridge_m: float, rng: VariantRng) -> list[Patch]:
    """Objects on a ridge: an aerial, a second chimney."""
    parts = []
    if rng.chance(0.4):
        parts.append(fittings.aerial(rng).moved(-0.1, at_m[1] + 0.8, ridge_m))
    if rng.chance(0.25):
        z = (ridge_m - 1.6, ridge_m + rng.between(0.3, 0.8))
        parts.append(roofs.chimney(at_m[0] - 0.2, at_m[1] + 1.6, z))
    return parts


def _on_slope(plan: building_designs.Design, rng: VariantRng) -> list[Patch]:
    """Roof windows or solar panels on the street side of a gable roof."""
    kind = rng.choose(("none", "none", "windows", "panels"))
    half, rise = 0.5 * plan.depth_m, math.tan(plan.pitch_rad)
    length = half / math.cos(plan.pitch_rad)
    if kind == "none" or length < 3.4:
        return []
    along = 0.25 * length
    x, z = half - along * math.cos(plan.pitch_rad), along * math.sin(plan.pitch_rad)
    if kind == "panels":
        made = fittings.solar_panels(plan.width_m - 1.0, rng)
    else:
        count = rng.choose((1, 2, 3))
        at = [plan.width_m * ((k + 0.5) / count - 0.5) for k in range(count)]
        made = join_patches([_roof_window(y, rng) for y in at])
    # The plane z = 0 with X downhill becomes the slope.
    return [made.rotated("y", math.atan(rise)).moved(x, 0.0, z + 0.09 / math.cos(plan.pitch_rad))]


def _roof_window(y: float, rng: VariantRng) -> Patch:
    """A window of 0.8 by 1.2 m flat in the plane z = 0, uphill to -X."""
    rim = [(0.0, y - 0.4), (0.0, y + 0.4), (-1.2, y + 0.4), (-1.2, y - 0.4)]
    frame = quad([(a, b, 0.0) for a, b in rim], facade.DARK)
    slot = rng.choose((facade.VIEW, facade.GLASS))
    pane = [(-0.08, y - 0.32), (-0.08, y + 0.32), (-1.12, y + 0.32), (-1.12, y - 0.32)]
    image = ((0.01, 0.24), (0.01, 0.24))
    return join_patches([frame, quad([(a, b, 0.01) for a, b in pane], slot, image)])


def _gable_front(plan: building_designs.Design, rng: VariantRng) -> Patch:
    """A gable roof whose ridge runs along X, with a window in the gable."""
    profile = roofs.gable_profile(plan.width_m, plan.pitch_rad, _EAVES_M)
    shell = roofs.over_profile(profile, plan.depth_m, plan.verge_m, 0.24)
    ridge = max(z for _, z in profile)
    low = 0.22 * ridge
    attic = facade.attic_window((-0.55, 0.55), (low, low + min(1.3, 0.4 * ridge)), rng)
    stack = roofs.chimney(-0.2 * plan.depth_m, 0.6, (max(0.0, ridge - 1.4), ridge + 0.6))
    return join_patches([shell.rotated("z", 0.5 * math.pi), attic.moved(0.5 * plan.depth_m), stack])


def _dormers(
    plan: building_designs.Design, slope: float, wing: Span | None, rng: VariantRng
) -> list[Patch]:
    """Dormers on the street side; ``slope`` is how far the roof recedes per metre of height."""
    foot = 0.45
    x = 0.5 * plan.depth_m - slope * foot - 0.05
    reach = min(slope * 2.2 + 0.3, x)
    at = [plan.width_m * ((k + 0.5) / plan.dormers - 0.5) for k in range(plan.dormers)]
    if wing is not None:
        at = [y for y in at if y < wing[0] - 0.6 or y > wing[1] + 0.6]
    return [roofs.dormer(x, y, foot, reach, rng) for y in at]
