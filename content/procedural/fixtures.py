"""Objects of manipulation tasks: cabinets, drawers, doors, knobs, buttons, pegs and sockets.

Origin on the floor, Z up. Parts that move have their handles towards -X; the joints belong to the
tasks that use them. All builders raise AssetError for an unknown colour.
"""

from collections.abc import Sequence

from gen_data.assets.family import Solid, check_option
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.furniture import COLORS, Box, check_size
from gen_data.content.procedural.material_presets import metal_material, painted_material
from gen_data.content.procedural.patches import Patch, make_solid_in_place
from gen_data.core import asset_types, se3

_WALL_M = 0.008
_BAR_M = 0.012
"""Side of the square section of handles: all grippers close around it."""
_REACH_M = 0.064
"""Free depth behind a handle, for one finger."""
_SIDES = 24
_STEEL = ((0.55, 0.56, 0.57), 0.35)


def open_cabinet(size_m: se3.Vec3 = (0.2, 0.24, 0.115), color: str = "white") -> Solid:
    """A box of boards, open towards -X. Slot: body.

    Args:
        size_m: Outer depth, width, height.
        color: One of ``COLORS``.
    """
    x, y, z = check_size("open_cabinet", size_m, 0.05)
    w = _WALL_M
    boards = [
        ((-x / 2, -y / 2, 0.0), (x / 2, y / 2, 0.004)),
        ((-x / 2, -y / 2, z - w), (x / 2, y / 2, z)),
        ((-x / 2, -y / 2, 0.004), (x / 2, -y / 2 + w, z - w)),
        ((-x / 2, y / 2 - w, 0.004), (x / 2, y / 2, z - w)),
        ((x / 2 - w, -y / 2 + w, 0.004), (x / 2, y / 2 - w, z - w)),
    ]
    return _boards(boards, (_paint("open_cabinet", color),))


def drawer(size_m: se3.Vec3 = (0.18, 0.2, 0.1), color: str = "brown") -> Solid:
    """A drawer whose front is at x = 0, with a bar before it. Slots: body, handle.

    Args:
        size_m: Depth and width of the tray, height of the front.
        color: One of ``COLORS``.
    """
    x, y, z = check_size("drawer", size_m, 0.06)
    w, side = _WALL_M, 0.6 * z
    boards = [
        ((-w, -y / 2, 0.0), (0.0, y / 2, z)),
        ((0.0, -y / 2 + w, 0.0), (x, y / 2 - w, w)),
        ((0.0, -y / 2 + w, w), (x, -y / 2 + 2 * w, side)),
        ((0.0, y / 2 - 2 * w, w), (x, y / 2 - w, side)),
        ((x - w, -y / 2 + 2 * w, w), (x, y / 2 - 2 * w, side)),
    ]
    b, r, h = _BAR_M, _REACH_M, 0.3 * y
    low = z - b
    bar = ((-w - r - b, -h, low), (-w - r, h, low + b))
    posts = [((-w - r, s - b / 2, low), (-w, s + b / 2, low + b)) for s in (b / 2 - h, h - b / 2)]
    materials = (_paint("drawer", color), metal_material(*_STEEL))
    return _boards(boards, materials, [bar, *posts])


def door_panel(size_m: se3.Vec3 = (0.012, 0.22, 0.2), color: str = "brown") -> Solid:
    """A door whose hinge is the Z axis; it covers Y up to its width. Slots: body, handle.

    Args:
        size_m: Thickness, width, height.
        color: One of ``COLORS``.
    """
    x, y, z = check_size("door_panel", size_m, 0.01)
    b, r = _BAR_M, _REACH_M
    panel = ((-x, 0.0, 0.0), (0.0, y, z))
    at = 0.85 * y
    bar = ((-x - r - b, at - b / 2, 0.4 * z), (-x - r, at + b / 2, z))
    posts = [((-x - r, at - b / 2, k), (-x, at + b / 2, k + b)) for k in (0.4 * z, 0.6 * z)]
    return _boards([panel], (_paint("door_panel", color), metal_material(*_STEEL)), [bar, *posts])


def knob(size_m: se3.Vec3 = (0.07, 0.014, 0.035), color: str = "black") -> Solid:
    """A bar handle on a round foot, turned about Z. Slots: foot, handle.

    Args:
        size_m: Length, width and height of the bar.
        color: One of ``COLORS``.
    """
    x, y, z = check_size("knob", size_m, 0.005)
    foot = 0.012
    bar = ((-x / 2, -y / 2, foot), (x / 2, y / 2, foot + z))
    disc = shapes.lathe([(0.0, 0.0), (0.3 * x, 0.0), (0.3 * x, foot), (0.0, foot)], _SIDES)
    return make_solid_in_place(
        [disc, shapes.block(*bar, 0.002, 1)],
        (metal_material(*_STEEL), _paint("knob", color)),
        [hulls.frustum((0.3 * x, 0.0), (0.3 * x, foot)), hulls.box(*bar)],
    )


def peg(diameter_m: float = 0.03, length_m: float = 0.09, color: str = "red") -> Solid:
    """An upright cylinder. Slot: body.

    Args:
        diameter_m: Its diameter.
        length_m: Its height.
        color: One of ``COLORS``.
    """
    r, z = 0.5 * diameter_m, length_m
    corners = [(0.0, 0.0), (r, 0.0), (r, z), (0.0, z)]
    body = shapes.lathe(shapes.fillet(corners, 0.05 * diameter_m, 2), _SIDES)
    hull = hulls.frustum((r, 0.0), (r, z), _SIDES)
    return make_solid_in_place([body], (_paint("peg", color),), [hull])


def ring(
    inner_m: float = 0.034, outer_m: float = 0.06, height_m: float = 0.03, color: str = "yellow"
) -> Solid:
    """An upright tube: a ring, or a socket for a peg. Slot: body.

    Args:
        inner_m: Diameter of the hole.
        outer_m: Outer diameter.
        height_m: Its height.
        color: One of ``COLORS``.
    """
    r, big, z = 0.5 * inner_m, 0.5 * outer_m, height_m
    seam = (r, 0.5 * z)
    section = [seam, (r, 0.0), (big, 0.0), (big, z), (r, z), seam]
    body = shapes.lathe(shapes.fillet(section, 0.001, 1), 2 * _SIDES)
    # Flat wedges cut into the hole between their corners: as far as it is rounder than they are.
    hull = hulls.ring((r, big, 0.0), (r, big, z), 16)
    return make_solid_in_place([body], (_paint("ring", color),), hull)


def hook_stand(height_m: float = 0.14, reach_m: float = 0.09, color: str = "grey") -> Solid:
    """A post on a foot, and an arm towards -X whose end points up. Slots: foot, metal.

    Args:
        height_m: Height of the upper side of the arm; its end is 2.5 cm higher.
        reach_m: Distance of the end from the post.
        color: Colour of the foot, one of ``COLORS``.
    """
    z, w = height_m, 0.006
    foot = ((-0.04, -0.05, 0.0), (0.06, 0.05, 0.012))
    bars = [
        ((-w, -w, 0.012), (w, w, z)),
        ((-reach_m - w, -w, z - 2 * w), (-w, w, z)),
        ((-reach_m - w, -w, z), (-reach_m + w, w, z + 0.025)),
    ]
    return _boards([foot], (_paint("hook_stand", color), metal_material(*_STEEL)), bars)


def plug(size_m: se3.Vec3 = (0.04, 0.026, 0.045), color: str = "white") -> Solid:
    """A plug that stands on its two pins. Slots: body, pins.

    Args:
        size_m: Length, width and height of its body.
        color: One of ``COLORS``.
    """
    x, y, z = check_size("plug", size_m, 0.02)
    body = ((-x / 2, -y / 2, _PIN_M[2]), (x / 2, y / 2, _PIN_M[2] + z))
    return _boards([body], (_paint("plug", color), metal_material(*_STEEL)), _pins(0.0))


def outlet(size_m: se3.Vec3 = (0.1, 0.08, 0.03), color: str = "grey") -> Solid:
    """A box with two slots from above for the pins of a plug, with 1.5 mm of play. Slot: body.

    Args:
        size_m: Length, width, height.
        color: One of ``COLORS``.
    """
    x, y, z = check_size("outlet", size_m, 0.03)
    (_, low, _), (_, high, _) = _pins(_PLAY_M)[0]
    ends = sorted(v for (a, _, _), (b, _, _) in _pins(_PLAY_M) for v in (a, b))
    edges = [-x / 2, *ends, x / 2]
    strips = [(edges[k], edges[k + 1]) for k in (0, 2, 4)]
    boards = [((a, low, 0.0), (b, high, z)) for a, b in strips]
    boards += [((-x / 2, -y / 2, 0.0), (x / 2, low, z)), ((-x / 2, high, 0.0), (x / 2, y / 2, z))]
    return _boards(boards, (_paint("outlet", color),))


_PIN_M, _PIN_AT_M, _PLAY_M = (0.005, 0.014, 0.022), 0.01, 0.0015
"""Size of the pins of plugs, distance from the middle, and play around them on each side."""


def _pins(play_m: float) -> list[Box]:
    x, y, z = _PIN_M
    half = (0.5 * x + play_m, 0.5 * y + play_m)
    return [
        ((at - half[0], -half[1], 0.0), (at + half[0], half[1], z))
        for at in (-_PIN_AT_M, _PIN_AT_M)
    ]


def _boards(
    boards: Sequence[Box], materials: tuple[asset_types.Material, ...], handles: Sequence[Box] = ()
) -> Solid:
    """Boards in slot 0 and handles in slot 1."""
    patches: list[Patch] = [shapes.block(low, high, 0.001) for low, high in boards]
    patches += [shapes.block(low, high, 0.002, 1) for low, high in handles]
    return make_solid_in_place(patches, materials, [hulls.box(*b) for b in (*boards, *handles)])


def _paint(name: str, color: str) -> asset_types.Material:
    check_option(name, "color", color, tuple(COLORS))
    return painted_material(COLORS[color], 0.5)
