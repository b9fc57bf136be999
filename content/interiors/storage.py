"""Cupboards, shelves, appliances and racks. Parts that open are separate families.

The origin of a part is the hinge of a door, or the closed position of a drawer. The keypoints
``hinge`` and ``slide`` of the piece mark these points.
"""

from dataclasses import replace

from gen_data.assets.family import Solid
from gen_data.content.interiors.cartons import carton_looks, tape_carton
from gen_data.content.interiors.parts import (
    LACQUERS,
    Box,
    Measures,
    board,
    brushed_steel,
    drawn,
    front,
    handle,
    lacquer,
    posts,
    rod,
    solid,
    wood,
)
from gen_data.content.interiors.soft_goods import pillow
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.furniture import rectangle, shelf_levels_m
from gen_data.content.procedural.material_presets import (
    STAINLESS,
    ZINC,
    metal_material,
    painted_material,
    patterned_material,
    printed_material,
)
from gen_data.content.procedural.patches import Patch
from gen_data.core.asset_types import Keypoint, Material
from gen_data.core.keypoint_names import INSIDE
from gen_data.core.variant_rng import VariantRng, variant_rng

_T = 0.018
"""Thickness of boards."""
_WORKTOPS = ("granite", "granite", "wood_grain", "wood_grain", "marble", "concrete")
VARIANTS_PER_LOOK = 2
"""Kitchen units of consecutive seeds that look alike."""
PITCH_M = 0.36
"""Usual distance between the boards of bookcases; racks for pallets have four times as much."""


def carcass(
    depth_m: float, width_m: float, low_m: float, high_m: float, boards: int = 0
) -> list[Box]:
    """Sides, back, bottom, top and inner boards of an open box of boards."""
    x0, x1, y0, y1, t = -0.5 * depth_m, 0.5 * depth_m, -0.5 * width_m, 0.5 * width_m, _T
    made: list[Box] = [
        ((x0, y0, low_m), (x1, y0 + t, high_m)),
        ((x0, y1 - t, low_m), (x1, y1, high_m)),
        ((x0, y0 + t, low_m), (x0 + 0.006, y1 - t, high_m)),
        ((x0 + 0.006, y0 + t, low_m), (x1, y1 - t, low_m + t)),
        ((x0 + 0.006, y0 + t, high_m - t), (x1, y1 - t, high_m)),
    ]
    for k in range(1, boards + 1):
        z = low_m + k * (high_m - low_m) / (boards + 1)
        made.append(((x0 + 0.006, y0 + t, z - 0.5 * t), (x1 - 0.01, y1 - t, z + 0.5 * t)))
    return made


def _looks(family: str, rng: VariantRng, seed: int) -> list[Material]:
    steel = brushed_steel(seed)
    if family == "refrigerator":
        shell = rng.choose((painted_material("#f2f2f0", 0.3), steel))
        return [shell, shell, steel]
    if family in ("kitchen_unit", "wall_unit"):
        # One kitchen has one look: variants of the same number match.
        shared = variant_rng("kitchen", seed // VARIANTS_PER_LOOK)
        facing = front(shared)
        texture = f"texture/{shared.choose(_WORKTOPS)}?seed={int(shared.between(0, 16))}"
        worktop = patterned_material(texture, 0.5, 0.3)
        return [painted_material("#eeede9", 0.5), facing, steel, worktop]
    body = front(rng)
    return [body, body if rng.chance(0.5) else lacquer(rng), steel]


def cupboard(family: str, seed: int, measures: Measures) -> Solid:
    """A cupboard without the door that opens. Slots: carcass, front, handle, then worktop.

    Measures: depth, width, lower and upper edge of the fronts, number of doors.
    """
    rng = variant_rng(family, seed)
    d, w, low, high, doors = drawn(rng, measures).values()
    levels = _levels_m(family, low, high)
    x, half = 0.5 * d, 0.5 * w
    boards = carcass(d, w, low, high)
    if family == "wardrobe":
        boards.append(((-x, -0.5 * _T, low), (x, 0.5 * _T, high)))
    for z in levels[1:]:
        boards.append(((-x + 0.006, -half + _T, z - _T), (x - 0.01, half - _T, z)))
    patches = [board(*b) for b in boards]
    outer: list[Box] = [*boards]
    if low > 0.0 and family != "refrigerator":
        plinth: Box = ((-x + 0.02, -0.5 * w, 0.0), (x - 0.05, 0.5 * w, low))
        patches.append(board(*plinth))
        outer.append(plinth)
    if family == "refrigerator":
        freezer: Box = ((-x, -0.5 * w, 0.0), (x + 0.045, 0.5 * w, low - 0.006))
        patches.append(shapes.block(*freezer, 0.012, 1))
        patches += handle(x + 0.045, 0.5 * w - 0.06, low - 0.2, 0.25, 2, upright=True)
        outer.append(((-x, -0.5 * w, 0.0), freezer[1]))
    if doors == 2:
        right: Box = ((x, 0.002, low + 0.003), (x + 0.018, 0.5 * w - 0.002, high - 0.003))
        patches.append(_leaf(right, 0.31 * seed))
        patches += handle(x + 0.018, 0.04, _grip(low, high), 0.18, 2, upright=True)
        outer.append(right)
    if family == "kitchen_unit":
        top: Box = ((-x - 0.0, -0.5 * w, high), (x + 0.03, 0.5 * w, 0.9))
        patches.append(shapes.block(*top, 0.003, 3))
        # Behind the gaps between fronts it is dark.
        patch = board((x - 0.012, -0.5 * w + _T, high - 0.03), (x - 0.002, 0.5 * w - _T, high), 0)
        patches.append(patch)
        outer.append(top)
    if family == "wardrobe":
        rail = levels[1] + RAIL_M
        patches.append(rod((0.0, -0.5 * w + 0.02, rail), (0.0, 0.5 * w - 0.02, rail), 0.012, 2))
    made = solid(patches, _looks(family, rng, seed), outer)
    # Behind the door, which covers the left half if there are two.
    end = (0.0 if doors == 2 and family == "wardrobe" else half) - _T
    inside = []
    for z, above in zip(levels, (*levels[1:], high), strict=True):
        inside.append(Keypoint(INSIDE, (-x + 0.02, -half + _T + 0.004, z)))
        inside.append(Keypoint(INSIDE, (x - 0.035, end - 0.004, above - _T - 0.004)))
    hinge = Keypoint("hinge", (x, -0.5 * w, low), 0.05)
    return replace(made, keypoints=(hinge, *inside))


RAIL_M = 1.2
"""Height of the rail of a wardrobe above the board below it."""


def _levels_m(family: str, low_m: float, high_m: float) -> tuple[float, ...]:
    """Heights of the boards of a cupboard, the lowest first."""
    if family == "wardrobe":
        return (low_m + _T, low_m + 0.44)
    count = 3 if family == "refrigerator" else 2
    return tuple(low_m + _T + k * (high_m - low_m - _T) / count for k in range(count))


def cupboard_door(family: str, seed: int, measures: Measures) -> Solid:
    """The door that opens of the cupboard of the same seed. Slots: carcass, front, handle."""
    rng = variant_rng(family, seed)
    _, w, low, high, doors = drawn(rng, measures).values()
    h, width = high - low, w / doors
    thick = 0.045 if family == "refrigerator" else 0.018
    leaf: Box = ((0.0, 0.002, 0.003), (thick, width - 0.002, h - 0.003))
    patch = (
        shapes.block(*leaf, 0.01, 1)
        if family == "refrigerator"
        else _leaf(leaf, 0.31 * seed + 0.13)
    )
    grip = 0.28 if family == "refrigerator" else _grip(low, high) - low
    bar = handle(
        thick, width - 0.05, grip, 0.25 if family == "refrigerator" else 0.16, 2, upright=True
    )
    looks = _looks(family, rng, seed)
    notes: list[Patch] = []
    if family == "refrigerator":
        notes = _notes(thick, width, h, variant_rng("notes", seed))
        looks += [
            painted_material("#f6f4ee", 0.8),
            painted_material("#f2e37a", 0.8),
            printed_material(f"texture/wall_art?seed={13 + 28 * (seed % 3)}", 0.6),
            printed_material(f"texture/wall_art?seed={11 + 28 * (seed % 3)}", 0.25),
            painted_material(LACQUERS[seed % len(LACQUERS)], 0.3),
            painted_material("#b3261e", 0.35),
        ]
    return solid([patch, *bar, *notes], looks, [leaf])


def _leaf(box: Box, log_m: float) -> Patch:
    """A door's board, cut at ``log_m`` from a log: boards of one look differ, as veneers do."""
    low, high = ((x, y + log_m, z) for x, y, z in box)
    return board(low, high, 1).moved(0.0, -log_m, 0.0)


def _notes(x: float, w: float, h: float, rng: VariantRng) -> list[Patch]:
    """Notes, photographs and a child's drawing under magnets, in slots 3 to 8."""
    made: list[Patch] = []
    for k in range(int(rng.between(0, 7))):
        a, b = rng.choose(((0.076, 0.076), (0.105, 0.148), (0.075, 0.1), (0.1, 0.21), (0.15, 0.2)))
        y, z = rng.between(0.05, w - 0.12 - a), rng.between(0.42 * h, 0.95 * h - b)
        slot = 3 + int(rng.random() * 4)
        at = x + 0.0006 * (k + 1)
        sheet = rectangle((at, 0.0, 0.0), (0.0, a, 0.0), (0.0, 0.0, b)).painted(slot)
        made.append(sheet.rotated("x", rng.between(-0.09, 0.09)).moved(0.0, y, z))
        pin = rod(
            (x, y + 0.5 * a, z + b - 0.012),
            (x + 0.008, y + 0.5 * a, z + b - 0.012),
            0.011,
            7 + k % 2,
            14,
        )
        made.append(pin)
    return made


def _grip(low: float, high: float) -> float:
    """Height of a handle: low on wall units, high on base units, at the hand on wardrobes."""
    if low == 0.0:
        return 0.13
    return high - 0.14 if high < 1.0 else 1.05


def _chest_looks(family: str, rng: VariantRng) -> list[Material]:
    steel = metal_material(STAINLESS, 0.3)
    if family == "filing_cabinet":
        paint = painted_material(rng.choose(("#b8bcbe", "#5a5f63", "#d8d6cf", "#2f3336")), 0.4)
        return [paint, paint, steel]
    if family == "tool_cabinet":
        paint = painted_material(rng.choose(("#a3261d", "#1f4e79", "#2c2f33")), 0.3)
        return [paint, paint, steel]
    body = front(rng)
    return [body, body if rng.chance(0.6) else lacquer(rng), steel]


def chest(family: str, seed: int, measures: Measures) -> Solid:
    """A chest without its top drawer. Slots: carcass, front, handle.

    Measures: depth, width, height of the feet, number of drawers, height.
    """
    rng = variant_rng(family, seed)
    d, w, feet, count, z = drawn(rng, measures).values()
    boards = carcass(d, w, feet, z)
    patches = [board(*b) for b in boards]
    x, h = 0.5 * d, (z - feet - _T) / count
    boxes: list[Box] = [*boards]
    for k in range(count - 1):
        a = feet + _T * 0.5 + k * h
        face: Box = (
            (-x + 0.02, -0.5 * w + 0.022, a + 0.002),
            (x + 0.016, 0.5 * w - 0.022, a + h - 0.003),
        )
        patches.append(board(*face, 1))
        patches += handle(x + 0.016, 0.0, a + 0.6 * h, min(0.3, 0.4 * w), 2, upright=False)
        # A rail behind the gap below: nothing dark shows through.
        rail = shapes.block(
            (x - 0.012, -0.5 * w + 0.018, a - 0.015), (x + 0.01, 0.5 * w - 0.018, a + 0.02), 0.0, 1
        )
        patches.append(rail)
        boxes.append(face)
    patches += [board(*post) for post in posts(x - 0.04, 0.5 * w - 0.04, feet, 0.018)]
    made = solid(patches, _chest_looks(family, rng), boxes)
    slide = Keypoint("slide", (x, 0.0, z - _T * 0.5 - h), 0.05)
    return replace(made, keypoints=(slide,))


def drawer(family: str, seed: int, measures: Measures) -> Solid:
    """The top drawer of the chest of the same seed. Slots: carcass, front, handle."""
    rng = variant_rng(family, seed)
    d, w, feet, count, z = drawn(rng, measures).values()
    h, depth, half = (z - feet - _T) / count, d - 0.04, 0.5 * w - 0.022
    boxes: list[Box] = [
        ((0.0, -half, 0.002), (0.016, half, h - _T * 0.5 - 0.003)),
        ((-depth, -half + 0.01, 0.012), (0.0, -half + 0.022, 0.7 * h)),
        ((-depth, half - 0.022, 0.012), (0.0, half - 0.01, 0.7 * h)),
        ((-depth, -half + 0.022, 0.012), (-depth + 0.012, half - 0.022, 0.7 * h)),
        ((-depth, -half + 0.01, 0.006), (0.0, half - 0.01, 0.014)),
    ]
    patches = [board(*boxes[0], 1), *(board(*b) for b in boxes[1:])]
    patches += handle(0.016, 0.0, 0.6 * h, min(0.3, 0.4 * w), 2, upright=False)
    return solid(patches, _chest_looks(family, rng), boxes)


def bookcase(rng: VariantRng) -> Solid:
    """A bookcase. Slot: boards."""
    d = rng.between(0.26, 0.36, "depth_m")
    w = rng.turn((0.4, 0.8, 1.0), "width_m")
    z = rng.between(0.9, 2.05, "height_m")
    return _shelves(d, w, z, [front(rng)])


def steel_rack(rng: VariantRng) -> Solid:
    """A rack of steel for storage. Slots: boards, posts."""
    d = rng.between(0.4, 0.55, "depth_m")
    w = rng.between(0.9, 1.3, "width_m")
    z = rng.between(1.7, 2.0, "height_m")
    paint = painted_material(rng.choose(("#a9adb0", "#3b4046", "#2f5d7c")), 0.4)
    return _shelves(d, w, z, [metal_material(ZINC, 0.45), paint], posts=True)


def _shelves(d: float, w: float, z: float, looks: list[Material], *, posts: bool = False) -> Solid:
    levels = board_levels_m(z)
    t, x, y = 0.02, 0.5 * d, 0.5 * w
    boards: list[Box] = [((-x + 0.004, -y + t, h - t), (x - 0.008, y - t, h)) for h in (*levels, z)]
    if posts:
        frame: list[Box] = [
            (
                (sx * x - 0.02 * (sx + 1), sy * y - 0.02 * (sy + 1), 0.0),
                (sx * x + 0.02 * (1 - sx), sy * y + 0.02 * (1 - sy), z),
            )
            for sx in (-1, 1)
            for sy in (-1, 1)
        ]
    else:
        frame = [
            ((-x, -y, 0.0), (x, -y + t, z)),
            ((-x, y - t, 0.0), (x, y, z)),
            ((-x, -y + t, 0.04), (-x + 0.005, y - t, z)),
        ]
    slot = 1 if posts else 0
    patches = [*(board(*b) for b in boards), *(board(*b, slot) for b in frame)]
    return solid(patches, looks, [*boards, *frame])


def board_levels_m(height_m: float) -> tuple[float, ...]:
    """Heights of the boards of a bookcase or rack of a height, the lowest first."""
    return shelf_levels_m((1.0, 1.0, height_m), max(1, round((height_m - 0.06) / PITCH_M)))


def pallet_rack(rng: VariantRng) -> Solid:
    """A rack for pallets with three levels above the floor. Slots: uprights, beams, decks."""
    d, w = 1.3, rng.between(2.4, 2.8, "width_m")
    z = 3 * PALLET_PITCH_M + rng.between(0.1, 0.3)
    uprights: list[Box] = []
    for sy in (-1, 1):
        for x in (-0.5 * d, 0.5 * d - 0.1):
            y = sy * (0.5 * w - 0.04)
            uprights.append(((x, y - 0.04, 0.0), (x + 0.1, y + 0.04, z)))
    beams: list[Box] = []
    decks: list[Box] = []
    for k in (1, 2):
        h = k * PALLET_PITCH_M
        for x in (-0.5 * d, 0.5 * d - 0.05):
            beams.append(((x, -0.5 * w + 0.08, h - 0.13), (x + 0.05, 0.5 * w - 0.08, h - 0.012)))
        decks.append(((-0.5 * d, -0.5 * w + 0.08, h - 0.012), (0.5 * d, 0.5 * w - 0.08, h)))
    patches: list[Patch] = [shapes.block(*b, 0.004) for b in uprights]
    patches += [shapes.block(*b, 0.004, 1) for b in beams]
    patches += [shapes.block(*b, 0.0, 2) for b in decks]
    for sy in (-1, 1):
        y = sy * (0.5 * w - 0.04)
        for k in range(6):
            a, b = 0.2 + k * (z - 0.4) / 6, 0.2 + (k + 1) * (z - 0.4) / 6
            xs = (-0.45, 0.45) if k % 2 else (0.45, -0.45)
            patches.append(rod((xs[0] * d, y, a), (xs[1] * d, y, b), 0.018, 0))
    looks = [
        painted_material("#1f4e8c", 0.4),
        painted_material("#d9641e", 0.4),
        metal_material(ZINC, 0.5),
    ]
    return solid(patches, looks, [*uprights, *beams, *decks])


PALLET_PITCH_M = 1.5
"""Distance between the levels of racks for pallets."""


def pallet(rng: VariantRng) -> Solid:
    """A pallet of 1.2 m by 0.8 m (EN 13698-1), most with boxes. Slots: wood, boxes."""
    patches: list[Patch] = []
    for y in (-0.3275, 0.0, 0.3275):
        patches.append(board((-0.6, y - 0.05, 0.0), (0.6, y + 0.05, 0.022)))
        for x in (-0.5275, 0.0, 0.5275):
            patches.append(board((x - 0.07, y - 0.05, 0.022), (x + 0.07, y + 0.05, 0.1)))
    for x in (-0.5275, 0.0, 0.5275):
        patches.append(board((x - 0.07, -0.4, 0.1), (x + 0.07, 0.4, 0.122)))
    for k in range(5):
        y = -0.3275 + k * 0.16375
        patches.append(board((-0.6, y - 0.06, 0.122), (0.6, y + 0.06, 0.144)))
    boxes: list[Box] = [((-0.6, -0.4, 0.0), (0.6, 0.4, 0.144))]
    goods, looks, high = _goods(rng.seed, rng)
    patches += [patch.moved(0.0, 0.0, 0.144) for patch in goods]
    if high > 0.0:
        boxes.append(((-0.59, -0.39, 0.144), (0.59, 0.39, 0.144 + high)))
    return solid(patches, [wood(rng, 0.8), *looks], boxes)


def _goods(seed: int, rng: VariantRng) -> tuple[list[Patch], list[Material], float]:
    """Load of a pallet, above z = 0 and from slot 1 on; its materials and height [m]."""
    match seed % 9:
        case 0 | 1 | 2 | 3:
            return _cartons(seed, rng, wrapped=seed % 9 in (1, 3))
        case 4:
            return _sacks(rng)
        case 5:
            return _drums(rng)
        case 6:
            return _crates(rng)
        case 7:
            return _mixed(seed, rng)
        case _:
            return [], [], 0.0


def _cartons(
    seed: int, rng: VariantRng, *, wrapped: bool
) -> tuple[list[Patch], list[Material], float]:
    """Layers of equal cartons, some wrapped in film."""
    patches: list[Patch] = []
    rows = rng.whole(1, 5, "rows")
    nx, ny = rng.choose(((3, 2), (2, 2), (4, 2), (4, 3), (2, 1)))
    h = rng.between(0.2, 0.3, "layer_m") if rows > 2 else rng.between(0.22, 0.36, "layer_m")
    a, b = 1.16 / nx, 0.76 / ny
    for row in range(rows):
        for i in range(nx):
            for j in range(ny):
                if row == rows - 1 and rows > 1 and not wrapped and rng.chance(0.25):
                    continue
                # Nobody stacks to the millimetre.
                x, y = (rng.between(-0.006, 0.006) for _ in range(2))
                x, y, z = x - 0.58 + i * a, y - 0.38 + j * b, row * h
                low, top = (x + 0.003, y + 0.003, z), (x + a - 0.003, y + b - 0.003, z + h - 0.001)
                tape_carton(patches, low, top, rng, (1, 2, 3, 4))
    looks = carton_looks(rng, seed)
    return patches, _in_film(looks) if wrapped else looks, rows * h


def _in_film(looks: list[Material]) -> list[Material]:
    """Materials under stretch film, which makes them glossy; the film has no mesh."""
    return [replace(look, roughness=_FILM_ROUGHNESS) for look in looks]


_FILM_ROUGHNESS = 0.3


def _sacks(rng: VariantRng) -> tuple[list[Patch], list[Material], float]:
    """Paper or plastic sacks in layers, lying across each other."""
    patches: list[Patch] = []
    rows, t = rng.whole(2, 6, "rows"), 0.12
    for row in range(rows):
        for k in range(3):
            x, y = -0.39 + 0.39 * k, 0.0
            sack = pillow(0.185, 0.37, 0.15, rng, 1)
            shift = rng.between(-0.012, 0.012)
            patch = sack.rotated("z", rng.between(-0.04, 0.04)).moved(x + shift, y + shift, row * t)
            patches.append(patch)
    paper = rng.choose(("#c8a878", "#e9e6de", "#d9d2c3", "#b9a58a"))
    return patches, [painted_material(paper, 0.75)], rows * t + 0.03


def _drums(rng: VariantRng) -> tuple[list[Patch], list[Material], float]:
    """Six drums or canisters."""
    r, h = 0.185, rng.between(0.45, 0.62, "height_m")
    patches: list[Patch] = []
    profile = [(0.0, 0.0), (r, 0.0), (r, 0.3 * h), (r + 0.006, 0.33 * h), (r, 0.36 * h),
               (r, 0.64 * h), (r + 0.006, 0.67 * h), (r, 0.7 * h), (r, h), (r - 0.012, h),
               (r - 0.014, h - 0.014), (0.0, h - 0.014)]  # fmt: skip
    for i in range(3):
        for j in range(2):
            x, y = -0.39 + 0.39 * i, -0.195 + 0.39 * j
            patches.append(shapes.lathe(profile, 36, 1).moved(x, y))
            patches.append(rod((x + 0.1, y, h - 0.02), (x + 0.1, y, h - 0.002), 0.025, 2, 14))
            label = shapes.lathe([(r + 0.001, 0.4 * h), (r + 0.001, 0.6 * h)], 36, 3)
            keep = label.corners_m[:, :, 0].min(axis=1) > 0.35 * r
            patch = replace(
                label, corners_m=label.corners_m[keep], uvs=label.uvs[keep], slots=label.slots[keep]
            ).moved(x, y)
            patches.append(patch)
    paint = rng.choose(("#1f5fa8", "#2b2d30", "#a3261d", "#2f6f4f", "#d9d6cf"))
    return (
        patches,
        [
            painted_material(paint, 0.35),
            painted_material("#1d1e20", 0.4),
            painted_material("#f3f1ea", 0.6),
        ],
        h,
    )


def _crates(rng: VariantRng) -> tuple[list[Patch], list[Material], float]:
    """Plastic crates in stacks of different heights."""
    patches: list[Patch] = []
    h, top = 0.22, 0.0
    for i in range(2):
        for j in range(2):
            rows = int(rng.between(2, 5))
            top = max(top, rows * h)
            for row in range(rows):
                x0, y0, z0 = -0.585 + 0.59 * i, -0.385 + 0.39 * j, row * h
                x1, y1, z1 = x0 + 0.58, y0 + 0.38, z0 + h - 0.004
                slot = 1 + int(rng.random() * 2)
                patch = shapes.block(
                    (x0 + 0.012, y0 + 0.012, z0), (x1 - 0.012, y1 - 0.012, z1 - 0.03), 0.004, slot
                )
                patches.append(patch)
                for z in (z0, z1 - 0.03, z0 + 0.45 * h):
                    patches.append(shapes.block((x0, y0, z), (x1, y1, z + 0.022), 0.004, slot))
                for k in range(6):
                    a = x0 + (k + 0.5) * 0.58 / 6
                    patches.append(
                        shapes.block((a - 0.006, y0, z0), (a + 0.006, y1, z1), 0.0, slot)
                    )
                for k in range(4):
                    a = y0 + (k + 0.5) * 0.38 / 4
                    patches.append(
                        shapes.block((x0, a - 0.006, z0), (x1, a + 0.006, z1), 0.0, slot)
                    )
    options = (
        ("#1f5fa8", "#1f5fa8"),
        ("#a3261d", "#5b5f64"),
        ("#2f6f4f", "#2f6f4f"),
        ("#5b5f64", "#e6c229"),
    )
    colors = rng.choose(options)
    return patches, [painted_material(c, 0.45) for c in colors], top


def _mixed(seed: int, rng: VariantRng) -> tuple[list[Patch], list[Material], float]:
    """Cartons of different sizes, as for one customer, in film."""
    patches: list[Patch] = []
    top = 0.0
    for i in range(2):
        for j in range(2):
            z = 0.0
            for _ in range(int(rng.between(1, 4))):
                h = rng.between(0.18, 0.42)
                x0, y0 = -0.58 + 0.585 * i, -0.38 + 0.385 * j
                a, b = rng.between(0.44, 0.57), rng.between(0.28, 0.375)
                tape_carton(patches, (x0, y0, z), (x0 + a, y0 + b, z + h), rng, (1, 2, 3, 4))
                z += h + 0.001
            top = max(top, z)
    return patches, _in_film(carton_looks(rng, seed)), top


def storage_box(rng: VariantRng) -> Solid:
    """A closed box of cardboard or plastic. Slots: body, lid."""
    x = 0.5 * rng.between(0.28, 0.44, "depth_m")
    y = 0.5 * rng.between(0.3, 0.56, "width_m")
    z = rng.between(0.18, 0.4, "height_m")
    low: Box = ((-x, -y, 0.0), (x, y, z - 0.03))
    lid: Box = ((-x - 0.006, -y - 0.006, z - 0.06), (x + 0.006, y + 0.006, z))
    if rng.chance(0.5):
        looks = [patterned_material(f"texture/cardboard?seed={rng.seed % 16}", 0.5, 0.85)] * 2
    else:
        looks = [painted_material(rng.choose((*LACQUERS, "#2f6f9f", "#7a8f5a")), 0.4)] * 2
    whole: Box = (low[0], (x, y, z))
    if rng.seed % 2:
        carton: list[Patch] = []
        tape_carton(carton, low[0], (x, y, z), rng, (0, 1, 2, 3))
        return solid(carton, carton_looks(rng, rng.seed), [whole])
    return solid([shapes.block(*low, 0.008), shapes.block(*lid, 0.006, 1)], looks, [whole])


def tv_stand(rng: VariantRng) -> Solid:
    """A low board for a television. Slots: carcass, front, handle."""
    d = rng.between(0.38, 0.45, "depth_m")
    w = rng.between(1.2, 1.9, "width_m")
    z = rng.between(0.4, 0.55, "height_m")
    boards = carcass(d, w, 0.1, z, 1)
    patches = [board(*b) for b in boards]
    x = 0.5 * d
    third = w / 3
    for k in (0, 2):
        a = -0.5 * w + k * third
        patches.append(board((x, a + 0.003, 0.103), (x + 0.018, a + third - 0.003, z - 0.003), 1))
    patches += [board(*post) for post in posts(x - 0.05, 0.5 * w - 0.1, 0.1, 0.02)]
    body = front(rng)
    whole: Box = ((-x, -0.5 * w, 0.0), (x + 0.018, 0.5 * w, z))
    return solid(patches, [body, body if rng.chance(0.5) else lacquer(rng)], [whole])


def washing_machine(rng: VariantRng) -> Solid:
    """A washing machine. Slots: body, ring, glass, panel."""
    d, x = rng.between(0.52, 0.6, "depth_m"), 0.0
    x = 0.5 * d
    body: Box = ((-x, -0.3, 0.0), (x, 0.3, 0.85))
    profile = [
        (0.0, 0.0),
        (0.19, 0.0),
        (0.19, 0.02),
        (0.17, 0.035),
        (0.13, 0.03),
        (0.13, 0.01),
        (0.0, 0.01),
    ]
    ring = shapes.lathe(profile, 40, 1)
    glass = shapes.lathe([(0.0, 0.0), (0.13, 0.012), (0.09, 0.035), (0.0, 0.045)], 32, 2)
    patches: list[Patch] = [
        shapes.block(*body, 0.008),
        ring.rotated("y", 1.5707963).moved(x, 0.0, 0.42),
        glass.rotated("y", 1.5707963).moved(x, 0.0, 0.42),
        shapes.block((x, -0.29, 0.72), (x + 0.006, 0.29, 0.84), 0.002, 3),
        shapes.block((x, -0.28, 0.735), (x + 0.014, -0.12, 0.825), 0.004, 0),
        rod((x, 0.1, 0.78), (x + 0.03, 0.1, 0.78), 0.028, 1, 20),
    ]
    paint = painted_material("#f3f3f1" if rng.chance(0.8) else "#8a8d90", 0.3)
    looks = [
        paint,
        metal_material(STAINLESS, 0.25),
        Material((0.03, 0.03, 0.035), 0.08),
        painted_material("#2a2c2e", 0.3),
    ]
    return solid(patches, looks, [body])
