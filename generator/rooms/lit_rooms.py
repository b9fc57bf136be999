"""Rooms of a scene as boxes that reflect light."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gen_data.assets.asset_ids import parse_asset_id
from gen_data.core import interfaces, se3
from gen_data.core.scene import Body, Scene
from gen_data.rooms.floor_plan import WALL_M
from gen_data.rooms.interreflection import Hole, LitRoom

_SIDES = {"wall_0": 1, "wall_1": 3, "wall_2": 0, "wall_3": 2, "ceiling": 4, "floor": 5}
"""Sides of ``interreflection.AXES`` by the names of bodies."""
_HIDES = 0.55
"""Share of the surface of a piece's box that light meets: legs, gaps and backs at walls do not
count (assumed)."""


def find_lit_rooms(scene: Scene, name: str, assets: interfaces.AssetIndex) -> tuple[LitRoom, ...]:
    """The rooms of a ``room_layout`` element, with reflectances of the surfaces drawn for them."""
    own = [b for b in scene.bodies if b.name.partition("/")[0] == name]
    boxes: dict[str, list[Body]] = {}
    for body in own:
        boxes.setdefault(body.name.split("/")[1], []).append(body)
    floors = [b for b in own if b.name.endswith("/floor")]
    rooms = [_lit_room(boxes[f.name.split("/")[1]], f, assets) for f in floors]
    openness = {i.instance_id: float(dict(i.attributes).get("open", "0")) for i in scene.instances}
    for body in own:
        word = body.name.rpartition("/")[2].partition("_")[0]
        if word in ("door", "window") and body.part_id < 2:
            _add_hole(rooms, body, word, openness[body.instance_id])
    return tuple(rooms)


def _lit_room(bodies: Sequence[Body], floor: Body, assets: interfaces.AssetIndex) -> LitRoom:
    (x0, y0, _), (x1, y1, _) = assets.bounds_m(floor.asset)
    x, y, _ = floor.T_world_body.translation_m
    prefix = floor.name.rpartition("/")[0]
    shell = {b.name.removeprefix(f"{prefix}/"): b for b in bodies}
    height = shell["ceiling"].T_world_body.translation_m[2]
    low, high = (x + x0, y + y0, 0.0), (x + x1, y + y1, height)
    colors = {side: _mean_color(shell[word], assets) for word, side in _SIDES.items()}
    surface_m2 = _box_surface_m2(low, high)
    pieces_m2 = sum(
        _box_surface_m2(*assets.bounds_m(b.asset)) for b in bodies if b.group and b.part_id < 2
    )
    furniture = 1.0 - math.exp(-_HIDES * pieces_m2 / surface_m2)
    return LitRoom(low, high, tuple(colors[k] for k in range(6)), furniture=furniture)


def _box_surface_m2(low: se3.Vec3, high: se3.Vec3) -> float:
    a, b, c = (h - w for w, h in zip(low, high, strict=True))
    return 2.0 * (a * b + b * c + c * a)


def _mean_color(body: Body, assets: interfaces.AssetIndex) -> se3.Vec3:
    material = (body.materials or assets.materials(body.asset))[0]
    if not material.texture:
        return material.base_color
    mean = assets.mean_color(material.texture)
    r, g, b = (m * c for m, c in zip(mean, material.base_color, strict=True))
    return (r, g, b)


def _add_hole(rooms: list[LitRoom], body: Body, word: str, openness: float) -> None:
    """Add a window to its room, or a door between two rooms to both."""
    width, height, depth = _size_m(body.asset)
    x, y, z = body.T_world_body.translation_m
    w, _, _, qz = body.T_world_body.quaternion_wxyz
    wall = round(2.0 * math.atan2(qz, w) / (0.5 * math.pi)) % 4
    axis = wall % 2
    ahead = np.zeros(3)
    ahead[axis] = 1.0 if wall < 2 else -1.0
    aside = np.array([0.5 * width * (axis == 1), 0.5 * width * (axis == 0), 0.0])
    at = np.array([x, y, z])
    ends = [_room_at(rooms, at + sign * (0.5 * depth + WALL_M) * ahead) for sign in (1.0, -1.0)]
    if word == "window":
        ends[1] = -1
    elif min(ends) < 0:
        return
    numbers = [len(rooms[k].holes) if k >= 0 else -1 for k in ends]
    for here, (k, way) in enumerate(zip(ends, (ahead, -ahead), strict=True)):
        if k < 0:
            continue
        side = 2 * axis + int(way[axis] > 0.0)
        corner = rooms[k].high_m if side % 2 == 0 else rooms[k].low_m
        low, high = at - aside, at + aside + (0.0, 0.0, height)
        low[axis] = high[axis] = corner[axis]
        other = ends[1 - here]
        twin = (other, numbers[1 - here]) if other >= 0 else None
        passes = 1.0 if word == "window" else math.sin(0.5 * math.pi * openness)
        hole = Hole(side, tuple(low.tolist()), tuple(high.tolist()), passes, twin)
        rooms[k] = replace(rooms[k], holes=(*rooms[k].holes, hole))


def _size_m(asset: str) -> se3.Vec3:
    size = parse_asset_id(asset).parameters["size_m"]
    assert isinstance(size, tuple)
    width, height, depth = (float(v) for v in size)
    return (width, height, depth)


def _room_at(rooms: Sequence[LitRoom], at: np.ndarray) -> int:
    """Number of the room that a point on its floor plan is in; -1 = none."""
    for k, room in enumerate(rooms):
        if all(room.low_m[i] - 1e-6 <= at[i] <= room.high_m[i] + 1e-6 for i in (0, 1)):
            return k
    return -1
