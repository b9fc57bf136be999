"""The inside of a room: floor, ceiling, walls, skirting, a door and a window with depth."""

from gen_data.assets.family import Solid
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import material_presets as presets
from gen_data.content.procedural.furniture import check_size, rectangle
from gen_data.content.procedural.patches import Patch, make_solid_in_place
from gen_data.content.procedural.surface_shapes import block
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3


def room(size_m: Vec3 = (5.0, 4.0, 2.8), door: int = 1, window: int = 1, walls: int = 1) -> Solid:
    """The inside of a room, seen from within, or its floor alone: a terrace.

    Slots: floor, ceiling, walls, skirting, door, frames, window, handle. The door is in the wall
    at -X, the window in the wall at +Y; both are left out where the wall is too small for them.

    Args:
        size_m: Inner length, width, height; the floor is at z = 0.
        door: 1 with a door, 0 without.
        window: 1 with a window, 0 without.
        walls: 1 with walls and a ceiling, 0 with the floor alone.

    Raises:
        AssetError: if a size is not usable.
    """
    x, y, z = check_size("room", size_m, 1.0)
    has_door = door > 0 and y > 1.6 and z > 2.2
    has_window = window > 0 and x > 2.0 and z > 2.0
    a, b, t = x / 2, y / 2, 0.2
    floor = rectangle((-a, -b, 0.0), (x, 0.0, 0.0), (0.0, y, 0.0))
    if not walls:
        slab = hulls.box((-a, -b, -t), (a, b, 0.0))
        return make_solid_in_place([floor], _room_materials(), [slab])
    patches = [
        floor,
        rectangle((-a, b, z), (x, 0.0, 0.0), (0.0, -y, 0.0)).painted(1),
        rectangle((a, -b, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)).flipped().painted(2),
        rectangle((-a, -b, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)).painted(2),
        rectangle((-a, -b, 0.0), (x, 0.0, 0.0), (0.0, 0.0, z)).flipped().painted(2),
        *_skirting(x, y, 0.55 if has_door else 0.0),
        *(_door(-a) if has_door else ()),
        *_window_wall(x, b, z, has_window),
    ]
    slabs = [((-a - t, -b - t, z0), (a + t, b + t, z0 + t)) for z0 in (-t, z)]
    slabs += [((x0, -b - t, 0.0), (x0 + t, b + t, z)) for x0 in (-a - t, a)]
    slabs += [((-a, y0, 0.0), (a, y0 + t, z)) for y0 in (-b - t, b)]
    return make_solid_in_place(patches, _room_materials(), [hulls.box(*slab) for slab in slabs])


def _room_materials() -> tuple[Material, ...]:
    pane = Material((0.6, 0.7, 0.8), 0.08, emission_cd_m2=(230.0, 255.0, 290.0))
    return (
        presets.patterned_material("texture/wood_planks?seed=0", 1.6, 0.45),
        presets.painted_material("#f2f1ed", 0.9),
        presets.patterned_material("texture/plaster?seed=3", 1.5, 0.9),
        presets.painted_material("#eceae4", 0.5),
        presets.painted_material("#e9e7e1", 0.45),
        presets.painted_material("#f3f2ee", 0.4),
        pane,
        presets.metal_material(presets.STAINLESS, 0.3),
    )


def _skirting(x: float, y: float, door_half: float) -> list[Patch]:
    """Boards along the walls, 8 cm high; the one at -X leaves out the door."""
    a, b, t = x / 2, y / 2, 0.012
    spans = [(a - t, -b, a, b), (-a, -b, a, -b + t), (-a, b - t, a, b),
             (-a, -b, -a + t, -door_half), (-a, door_half, -a + t, b)]  # fmt: skip
    return [block((x0, y0, 0.0), (x1, y1, 0.08), 0.003, 3) for x0, y0, x1, y1 in spans]


def _door(wall: float) -> list[Patch]:
    """A panelled door of 0.9 m x 2.05 m with frame and handle on the wall x = ``wall``."""
    w, h = 0.45, 2.05
    # Extent along x from the wall, along y and z, edge radius, slot: leaf, panels, frame, handle.
    parts = [
        ((0.0, 0.012), (-w, w), (0.005, h), 0.001, 4),
        *(((0.012, 0.018), y, z, 0.005, 4)
          for y in ((-0.36, -0.06), (0.06, 0.36)) for z in ((0.2, 0.95), (1.15, 1.9))),
        ((0.0, 0.03), (-w - 0.08, -w), (0.0, h + 0.08), 0.004, 5),
        ((0.0, 0.03), (w, w + 0.08), (0.0, h + 0.08), 0.004, 5),
        ((0.0, 0.03), (-w, w), (h, h + 0.08), 0.004, 5),
        ((0.012, 0.018), (0.37, 0.41), (0.95, 1.15), 0.003, 7),
        ((0.018, 0.065), (0.38, 0.40), (1.04, 1.06), 0.004, 7),
        ((0.05, 0.07), (0.27, 0.40), (1.04, 1.06), 0.007, 7),
    ]  # fmt: skip
    return [
        block((wall + x0, y0, z0), (wall + x1, y1, z1), radius, slot)
        for (x0, x1), (y0, y1), (z0, z1), radius, slot in parts
    ]


def _window_wall(x: float, wall: float, z: float, window: bool) -> list[Patch]:
    """The wall y = ``wall``; around a window it is four rectangles, a reveal, frame and pane."""
    if not window:
        return [_facing_room(-x / 2, x / 2, 0.0, z, wall)]
    half, low, high, depth = min(0.8, 0.3 * x), 0.9, min(2.15, z - 0.25), 0.16
    around = ((-x / 2, -half, 0.0, z), (half, x / 2, 0.0, z), (-half, half, 0.0, low),
              (-half, half, high, z))  # fmt: skip
    faces = [_facing_room(*spans, wall) for spans in around]
    back = wall + depth
    reveal = [
        rectangle((-half, wall, low), (2 * half, 0, 0), (0, depth, 0)),
        rectangle((-half, back, high), (2 * half, 0, 0), (0, -depth, 0)),
        rectangle((-half, wall, low), (0, depth, 0), (0, 0, high - low)),
        rectangle((half, back, low), (0, -depth, 0), (0, 0, high - low)),
    ]
    w, y0 = 0.06, back - 0.05
    bars = [(-half, -half + w, low, high), (half - w, half, low, high),
            (-w / 2, w / 2, low, high), (-half + w, half - w, low, low + w),
            (-half + w, half - w, high - w, high)]  # fmt: skip
    frame = [block((a, y0, c), (b, back, d), 0.004, 5) for a, b, c, d in bars]
    edge = half + 0.05
    sill = block((-edge, wall - 0.04, low - 0.03), (edge, wall + 0.02, low + 0.002), 0.004, 5)
    pane = _facing_room(-half, half, low, high, back - 0.02).painted(6)
    return [*faces, *(face.painted(2) for face in reveal), *frame, sill, pane]


def _facing_room(x0: float, x1: float, z0: float, z1: float, y: float) -> Patch:
    """A rectangle in the plane of constant y that is seen from -Y."""
    return rectangle((x0, y, z0), (x1 - x0, 0.0, 0.0), (0.0, 0.0, z1 - z0)).painted(2)
