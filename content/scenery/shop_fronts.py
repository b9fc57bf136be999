"""Ground floors of shops: display windows, boards, awnings, shutters; in a wall's frame."""

from dataclasses import dataclass, replace

from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.scenery import awnings, facade
from gen_data.content.scenery.basic_shapes import Span, tube
from gen_data.content.scenery.facade import (
    ACCENT,
    AWNING,
    DISPLAY,
    DOOR,
    FACADE,
    FRAME,
    METAL,
    PRINT,
    SIGN,
    Opening,
)
from gen_data.content.scenery.facade_shapes import ledges, rectangles
from gen_data.content.scenery.textures.wall_signs import ADVERTS, BOARDS
from gen_data.core.variant_rng import VariantRng


@dataclass(frozen=True, slots=True)
class Premises:
    """The stretch of a ground floor that one shop has.

    Attributes:
        y_m: Its extent along the wall.
        top_m: Upper edge of its windows.
        ground_m: Height of the ground floor.
        paint: Slot of its joinery.
        board: Which board of the texture of signs it has.
        slot: Slot of the wall around it.
    """

    y_m: Span
    top_m: float
    ground_m: float
    paint: int
    board: int
    slot: int = FACADE


def ground_floor(half_m: float, ground_m: float, slot: int, rng: VariantRng) -> Patch:
    """A row of shops along a wall from -half_m to half_m."""
    count = max(1, round(2.0 * half_m / rng.between(5.0, 9.0)))
    edges = [-half_m + 2.0 * half_m * k / count for k in range(count + 1)]
    for k in range(1, count):
        edges[k] += rng.between(-0.12, 0.12) * 2.0 * half_m / count
    first = int(rng.random() * BOARDS)
    paints = rng.shuffled((ACCENT, FRAME, DOOR, AWNING))
    shops = [
        Premises(
            (edges[k], edges[k + 1]),
            ground_m - rng.between(0.95, 1.3),
            ground_m,
            paints[k % len(paints)],
            (first + k) % BOARDS,
            slot,
        )
        for k in range(count)
    ]
    return join_patches([_shop(shop, rng) for shop in shops])


def _shop(shop: Premises, rng: VariantRng) -> Patch:
    """Wall, windows, a door, a board, and awnings or signs over the pavement."""
    y0, y1 = shop.y_m[0] + 0.3, shop.y_m[1] - 0.3
    panes = max(1, round((y1 - y0 - 1.3) / rng.between(2.0, 3.4)))
    entrance = rng.choose((0, panes, int(rng.random() * (panes + 1))))
    wide = (y1 - y0 - 1.3) / panes
    closed = rng.chance(0.12)
    holes, parts, y = [], [], y0
    for k in range(panes + 1):
        if k == entrance:
            hole = Opening((y + 0.1, y + 1.2), (0.03, shop.top_m), 0.3)
            parts.append(_door(hole, shop, rng))
            y += 1.3
        else:
            hole = Opening((y + 0.07, y + wide - 0.07), (0.03, shop.top_m), 0.16)
            parts.append(_display(hole, shop, closed, rng))
            y += wide
        holes.append(hole)
    wall = facade.cut_openings(shop.y_m, (0.0, shop.ground_m), holes, shop.slot)
    return join_patches([wall, *parts, *_boards(shop, (y0, y1), rng), *_joinery(shop, rng)])


def _display(hole: Opening, shop: Premises, closed: bool, rng: VariantRng) -> Patch:
    """A pane over a stall riser, with posters on it; or a lowered shutter."""
    (y0, y1), (z0, z1) = hole.y_m, hole.z_m
    riser = z0 + rng.choose((0.08, 0.3, 0.5))
    depth_m = hole.recess_m + facade.GLASS_SETBACK_M
    upright = rng.choose((1, 1, 2)) if hole.width_m > 1.2 else 1
    glazed = replace(hole, z_m=(riser, z1), upright=upright, level=rng.choose((1, 1, 2)))
    parts = [
        facade.reveal(hole, depth_m, shop.slot),
        rectangles(-hole.recess_m, [(y0, y1, z0, riser)], shop.paint),
        facade.frame(glazed).painted(shop.paint),
        facade.panes(glazed, rng, -depth_m, DISPLAY),
    ]
    if closed or rng.chance(0.06):
        foot = z0 + rng.choose((0.0, 0.0, 0.3)) * hole.height_m
        x = 0.03 - hole.recess_m
        parts.append(ledges([(x - 0.02, x, y0 + 0.01, y1 - 0.01, foot, z1)], METAL))
    elif rng.chance(0.35):
        a = rng.between(y0 + 0.1, max(y0 + 0.11, y1 - 0.8))
        low = riser + rng.between(0.1, 0.5)
        parts.append(poster(-hole.recess_m + 0.006, (a, low), rng.between(0.35, 0.6), rng))
    return join_patches(parts)


def _door(hole: Opening, shop: Premises, rng: VariantRng) -> Patch:
    """A glazed leaf in joinery of the shop's paint."""
    (y0, y1), (z0, z1) = hole.y_m, hole.z_m
    x, head, w = -hole.recess_m, min(z1 - 0.25, z0 + 2.2), 0.12
    glass = Opening((y0 + w, y1 - w), (z0 + rng.choose((0.15, 0.5, 0.8)), head - w), 0.0)
    light = Opening(hole.y_m, (head, z1), 0.0)
    parts = [
        facade.reveal(hole, hole.recess_m + 0.01, shop.slot),
        rectangles(x, [(y0, y1, z0, z1)], shop.paint),
        facade.panes(glass, rng, x + 0.004, DISPLAY),
        facade.panes(replace(light, y_m=(y0 + w, y1 - w)), rng, x + 0.004, DISPLAY),
        ledges([(x, x + 0.06, y1 - 0.1, y1 - 0.06, z0 + 0.9, z0 + 1.3)], METAL),
    ]
    return join_patches(parts)


def _boards(shop: Premises, free_m: Span, rng: VariantRng) -> list[Patch]:
    """The name above the windows, on a hanging board, and an awning."""
    low, high = shop.top_m + 0.1, shop.ground_m - 0.12
    long = min(free_m[1] - free_m[0], 4.0 * (high - low), rng.between(2.4, 6.0))
    tall = min(high - low, 0.25 * long)
    options = (-0.5, 0.0, 0.0, 0.5)
    middle = 0.5 * (free_m[0] + free_m[1]) + rng.choose(options) * (free_m[1] - free_m[0] - long)
    image = (0.0, 1.0, shop.board / BOARDS, (shop.board + 1.0) / BOARDS)
    parts = []
    if rng.chance(0.5):
        parts.append(ledges([(0.0, 0.06, *free_m, low - 0.04, high)], shop.paint))
    z = 0.5 * (low + high - tall)
    place = (middle - 0.5 * long, middle + 0.5 * long, z, z + tall)
    parts += [ledges([(0.0, 0.1, *place)], METAL), rectangles(0.104, [place], SIGN, [image])]
    if rng.chance(0.35):
        parts.append(_hanging_board(rng.choose(free_m), shop, image, rng))
    if rng.chance(0.4):
        parts.append(awning(free_m, shop.top_m + 0.08, rng.between(0.7, 1.3), rng))
    return parts


def _hanging_board(
    y: float, shop: Premises, image: tuple[float, float, float, float], rng: VariantRng
) -> Patch:
    """A board across the pavement, to be read from both sides."""
    out_m, tall = rng.between(0.6, 0.9), rng.between(0.35, 0.6)
    z = shop.top_m + rng.between(-0.05, 0.2)
    arm = ledges([(0.0, 0.25 + out_m, y - 0.02, y + 0.02, z + tall, z + tall + 0.04)], METAL)
    u0, _, v0, v1 = image
    # A mark and the first letters: boards of this shape show no more.
    view = (u0, u0 + 0.5, v0, v1)
    face = rectangles(0.03, [(-0.5 * out_m, 0.5 * out_m, 0.0, tall)], SIGN, [view])
    sides = [
        face.rotated("z", turn).moved(0.2 + 0.5 * out_m, y, z) for turn in (1.5707963, -1.5707963)
    ]
    box = ledges([(0.2, 0.2 + out_m, y - 0.028, y + 0.028, z, z + tall)], METAL)
    return join_patches([arm, box, *sides])


def _joinery(shop: Premises, rng: VariantRng) -> list[Patch]:
    """Pilasters at both ends, lamps over the board."""
    parts = []
    if rng.chance(0.45):
        (y0, y1), z = shop.y_m, (0.0, shop.ground_m - 0.15)
        parts.append(ledges([(0.0, 0.07, y0, y0 + 0.22, *z), (0.0, 0.07, y1 - 0.22, y1, *z)],
                            shop.paint))  # fmt: skip
    if rng.chance(0.3):
        count, z0 = rng.choose((2, 3, 4)), shop.ground_m - 0.2
        step = (shop.y_m[1] - shop.y_m[0]) / (count + 1)
        at = [shop.y_m[0] + step * (k + 1) for k in range(count)]
        lamps = [(0.0, 0.35, y - 0.015, y + 0.015, z0, z0 + 0.03) for y in at]
        lamps += [(0.26, 0.4, y - 0.06, y + 0.06, z0 - 0.06, z0 + 0.02) for y in at]
        parts.append(ledges(lamps, METAL))
    return parts


def awning(y_m: Span, z1: float, out_m: float, rng: VariantRng) -> Patch:
    """A cloth roof over a shop window with a valance, in one colour or striped, and its arms."""
    (y0, y1), low = y_m, z1 - 0.32 * out_m
    is_striped = rng.chance(0.4)
    count = max(2, round((y1 - y0) / 0.3))
    edges = [y0 + (y1 - y0) * k / count for k in range(count + 1)]
    paints = (rng.choose((AWNING, ACCENT)), facade.WHITE)
    slots = [paints[k % 2 if is_striped else 0] for k in range(count)]
    parts = awnings.awning_cloth((out_m, low), (0.02, z1), edges, slots, 0.2)
    # The box that it rolls into, the bar in front, and the arms.
    box = (0.0, 0.1, y0, y1, z1 - 0.01, z1 + 0.1)
    bar = (out_m - 0.04, out_m - 0.006, y0, y1, low - 0.035, low - 0.006)
    parts.append(ledges([box, bar], METAL))
    parts += [
        tube([(0.02, y, z1 - 0.16), (0.5 * out_m, y, low - 0.1), (out_m - 0.03, y, low - 0.02)],
             0.014, 5).painted(METAL)
        for y in (y0 + 0.12, y1 - 0.12)
    ]  # fmt: skip
    return join_patches(parts)


def poster(x: float, at_m: tuple[float, float], size_m: float, rng: VariantRng) -> Patch:
    """A square sheet of an advert in the plane x, its lower left corner at (y, z)."""
    column, row = int(rng.random() * ADVERTS), int(rng.random() * ADVERTS)
    image = (column / ADVERTS, (column + 1.0) / ADVERTS, row / ADVERTS, (row + 1.0) / ADVERTS)
    y, z = at_m
    return rectangles(x, [(y, y + size_m, z, z + size_m)], PRINT, [image])
