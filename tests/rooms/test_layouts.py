"""Layouts of rooms keep their rules, whatever is drawn.

Bodies are measured by their boxes in the scene; the layout's own rectangles are not asked.
"""

import math
from collections import deque
from functools import cache
from itertools import combinations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.assets.library import Library
from gen_data.config import distributions as dist
from gen_data.core.errors import ConfigError, LayoutRejected
from gen_data.core.scene import Body, Scene
from gen_data.core.streams import Streams
from gen_data.randomizers.furnish import Furnish
from gen_data.scene_templates.builder import build_scene
from gen_data.scene_templates.room_layout import RoomLayout
from tests.libraries import library
from tests.tiers import seeds as of_seeds

KINDS = (
    "living_room", "kitchen", "bedroom", "office", "bathroom", "workshop", "warehouse", "apartment",
)  # fmt: skip
AGAINST_WALLS = (
    "bed", "bookcase", "cooker", "dresser", "filing_cabinet", "kitchen_sink", "pallet_rack",
    "refrigerator", "sofa", "steel_rack", "toilet", "tool_cabinet", "tv_stand", "wardrobe",
    "wash_basin", "washing_machine",
)  # fmt: skip
MAY_STAND_FREE = {"warehouse": {"pallet_rack"}}
MOVABLE = {"armchair", "chair", "clothes_pile", "office_chair", "stool"}
STRUCTURE = {"floor", "ceiling", "wall", "door", "window"}
SHOULDERS_M = 0.4
CELL_M = 0.1


@cache
def nominal(kind: str) -> Scene:
    return build_scene("test", (RoomLayout(name="room", kind=kind),), library())


@cache
def furnished(kind: str, seed: int, assets: Library | None = None) -> Scene:
    """A furnished room, by default with the assets that come with the package."""
    for attempt in range(4):
        try:
            rng = Streams(3, seed, attempt=attempt).rng("furniture")
            return Furnish(name="furniture")(nominal(kind), assets or library(), rng)
        except LayoutRejected:
            continue
    raise AssertionError(f"{kind} {seed}: four attempts were rejected")


def family(body: Body) -> str:
    return body.asset.partition("?")[0]


def is_tilted(body: Body) -> bool:
    """Whether a body is turned about another axis than the vertical."""
    return any(body.T_world_body.quaternion_wxyz[1:3])


def world_vertices(body: Body) -> NDArray[np.float64]:
    return body.T_world_body.apply(library().vertices_m(body.asset).astype(np.float64))


def outline(body: Body) -> NDArray[np.float32]:
    """Corners of the outline that a body covers on the floor, [n, 2]; of its box if upright."""
    if is_tilted(body):
        return cv2.convexHull(world_vertices(body)[:, :2].astype(np.float32))[:, 0]
    (x0, y0, _), (x1, y1, _) = library().bounds_m(body.asset)
    corners = body.T_world_body.apply(
        np.array([(x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0)])
    )
    return corners[:, :2].astype(np.float32)


def common_m2(a: Body, b: Body) -> float:
    """Area that the outlines of two bodies have in common, by OpenCV."""
    return float(cv2.intersectConvexConvex(outline(a), outline(b))[0])


def distance_m(body: Body, x: float, y: float) -> float:
    """Distance of a point from a body's outline, negative inside, by OpenCV."""
    return -float(cv2.pointPolygonTest(outline(body), (x, y), measureDist=True))


def heights_m(body: Body) -> tuple[float, float]:
    if is_tilted(body):
        z_m = world_vertices(body)[:, 2]
        return float(z_m.min()), float(z_m.max())
    low, high = library().bounds_m(body.asset)
    z = body.T_world_body.translation_m[2]
    return z + low[2], z + high[2]


def pieces(scene: Scene) -> list[Body]:
    return [b for b in scene.bodies if b.group == "room" and b.part_id < 2]


def floors(scene: Scene) -> list[tuple[float, float, float, float]]:
    """Extents of every room: smallest and largest x, smallest and largest y."""
    made = []
    for body in scene.bodies:
        if body.name.endswith("/floor"):
            (x0, y0, _), (x1, y1, _) = library().bounds_m(body.asset)
            x, y, _ = body.T_world_body.translation_m
            made.append((x + x0, x + x1, y + y0, y + y1))
    return made


each = pytest.mark.parametrize("kind", KINDS)
first_seeds = of_seeds(1, 6)


@pytest.mark.slow
@each
@first_seeds
def test_no_two_pieces_overlap(kind: str, seeds: range) -> None:
    """Where heights overlap, outlines do not; a rug lies under others."""
    for seed in seeds:
        placed = [b for b in pieces(furnished(kind, seed)) if family(b) != "rug"]
        for a, b in combinations(placed, 2):
            (low_a, high_a), (low_b, high_b) = heights_m(a), heights_m(b)
            if _is_stored(a, b) or _is_stored(b, a):
                continue
            if low_a < high_b - 1e-3 and low_b < high_a - 1e-3 and not _is_inside_shelf(a, b):
                assert common_m2(a, b) < 1e-3, (seed, a.name, b.name)


def _is_inside_shelf(a: Body, b: Body) -> bool:
    """Whether one of two is a shelf or seat, whose box, with back or tap, holds its load."""
    shelves = {
        "armchair", "bookcase", "chair", "pallet_rack", "sofa", "steel_rack", "trolley",
        "wash_basin",
    }  # fmt: skip
    return bool({family(a), family(b)} & shelves)


def _is_stored(thing: Body, holder: Body) -> bool:
    """Whether the box of a cupboard or bench holds an object's, or clothes hang around a chair."""
    if family(thing) == "draped_clothes":
        return family(holder) in {"chair", "office_chair"}
    if family(holder) not in {"kitchen_unit", "refrigerator", "wall_unit", "wardrobe", "workbench"}:
        return False
    (low, high), (bottom, top) = heights_m(thing), heights_m(holder)
    return (bottom <= low and high <= top) and all(
        distance_m(holder, float(x), float(y)) < 0.0 for x, y in outline(thing)
    )


@pytest.mark.slow
@each
@first_seeds
def test_everything_is_inside_the_walls(kind: str, seeds: range) -> None:
    """Outlines lie within the floor of a room, tops below its ceiling."""
    for seed in seeds:
        scene = furnished(kind, seed)
        for body in pieces(scene):
            (x0, y0), (x1, y1) = outline(body).min(axis=0), outline(body).max(axis=0)
            inside = [
                a - 2e-3 <= x0 and x1 <= b + 2e-3 and c - 2e-3 <= y0 and y1 <= d + 2e-3
                for a, b, c, d in floors(scene)
            ]
            assert any(inside), (seed, body.name)
            assert (
                heights_m(body)[0] >= -1e-4 and heights_m(body)[1] <= scene.interior_m[1][2] + 1e-3
            )


@pytest.mark.slow
@each
@first_seeds
def test_pieces_that_need_a_wall_touch_one(kind: str, seeds: range) -> None:
    """The middle of the back is within 2 cm of a wall."""
    for seed in seeds:
        scene = furnished(kind, seed)
        for body in pieces(scene):
            if family(body) in AGAINST_WALLS and family(body) not in MAY_STAND_FREE.get(kind, ()):
                back = library().bounds_m(body.asset)[0][0]
                x, y, _ = body.T_world_body.apply(np.array((back, 0.0, 0.0)))
                gap = min(
                    min(abs(x - a), abs(x - b), abs(y - c), abs(y - d))
                    for a, b, c, d in floors(scene)
                )

                assert gap < 0.02, (seed, body.name)


@pytest.mark.slow
@each
@first_seeds
def test_small_things_stand_on_something(kind: str, seeds: range) -> None:
    """Under the middle of objects off the floor, walls and ceiling, there is a surface."""
    hung = {
        "bathroom_cabinet", "coat_hooks", "draped_clothes", "light_switch", "notice_board",
        "parts_bins", "pegboard", "roll_holder", "socket", "utensil_rail", "wall_calendar",
        "wall_shelf", "picture", "mirror", "radiator", "towel", "wall_clock", "whiteboard",
        "curtain", "wall_unit", "range_hood", "ceiling_lamp", "tube_lamp", "wash_basin",
    }  # fmt: skip
    for seed in seeds:
        placed = pieces(furnished(kind, seed))
        for body in placed:
            low = heights_m(body)[0]
            if low < 0.015 or family(body) in hung:
                continue
            x, y = (float(v) for v in outline(body).mean(axis=0))
            below = [b for b in placed if b is not body and distance_m(b, x, y) < 0.0]
            tops = [z for b in below for z in _level_heights(b)]

            assert any(abs(low - z) < 2e-3 for z in tops), (seed, body.name, low, tops)


def _level_heights(body: Body) -> list[float]:
    """Heights of the horizontal faces that look up, from the mesh."""
    mesh = library().mesh(body.asset)
    corners = mesh.vertices_m[mesh.faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(cross, axis=1)
    up = cross[:, 2] > 1.99 * area * 0.999
    z = np.round(corners[up, :, 2].mean(axis=1), 3)
    return [float(v) + body.T_world_body.translation_m[2] for v in np.unique(z)]


@pytest.mark.slow
@each
@first_seeds
def test_every_door_is_reached_from_every_other_and_every_bed_and_cupboard_too(
    kind: str, seeds: range
) -> None:
    """A person 0.4 m wide walks there, by a flood fill over cells of 0.1 m."""
    goals = {"bed", "wardrobe", "refrigerator", "toilet", "wash_basin", "workbench", "desk", "sofa"}
    for seed in seeds:
        scene = furnished(kind, seed)
        blocked = [
            b
            for b in pieces(scene)
            if heights_m(b)[0] < 1.9
            and family(b) != "rug"
            and family(b) not in MOVABLE
            and "floor_things" not in b.name
            and max(_size(b)) > 0.35
        ]
        reached = _walk(scene, blocked)
        for body in pieces(scene):
            if family(body) in goals and heights_m(body)[0] < 0.3:
                assert min(distance_m(body, *p) for p in reached) < 0.75, (seed, body.name)
        for body in scene.bodies:
            if family(body) == "door_frame":
                assert min(distance_m(body, *p) for p in reached) < 0.6, (seed, body.name)


def _size(body: Body) -> tuple[float, float]:
    low, high = library().bounds_m(body.asset)
    return high[0] - low[0], high[1] - low[1]


def _walk(scene: Scene, blocked: list[Body]) -> list[tuple[float, float]]:
    """Middles of the cells reached from the first door, through doors [m]."""
    rooms = floors(scene)
    doors = [b for b in scene.bodies if family(b) == "door_frame"]
    half = 0.5 * SHOULDERS_M
    corners = [(outline(b), b) for b in blocked]

    def is_free(i: int, j: int) -> bool:
        x, y = i * CELL_M, j * CELL_M
        inside = any(
            a + half <= x <= b - half and c + half <= y <= d - half for a, b, c, d in rooms
        )
        passage = any(math.dist((x, y), d.T_world_body.translation_m[:2]) < 0.35 for d in doors)
        clear = all(
            cv2.pointPolygonTest(box, (x, y), measureDist=True) < -half for box, _ in corners
        )
        return passage or (inside and clear)

    first = doors[0].T_world_body.translation_m
    start = (round(first[0] / CELL_M), round(first[1] / CELL_M))
    seen, queue = {start}, deque([start])
    while queue:
        i, j = queue.popleft()
        for step in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
            if step not in seen and is_free(*step):
                seen.add(step)
                queue.append(step)
    return [(i * CELL_M, j * CELL_M) for i, j in seen]


@pytest.mark.slow
@of_seeds(2, 6)
def test_what_stands_behind_doors_is_within_its_cupboard(seeds: range) -> None:
    """Boxes of crockery, food and clothes lie in the box of a cupboard, 3 cm behind its front."""
    stored = 0
    families = {"crockery", "groceries", "hanging_clothes"}
    for kind in ("kitchen", "bedroom"):
        for seed in seeds:
            placed = pieces(furnished(kind, seed))
            for thing in (b for b in placed if family(b) in families):
                holders = [b for b in placed if _is_stored(thing, b)]
                depths = [
                    library().bounds_m(h.asset)[1][0]
                    - h.T_world_body.inverse()
                    .apply(np.insert(outline(thing).astype(np.float64), 2, 0.0, axis=1))[:, 0]
                    .max()
                    for h in holders
                ]
                stored += 1
                assert len(holders) == 1, (kind, seed, thing.name)
                assert min(depths) > 0.03

    assert stored > 2 * len(seeds)


@pytest.mark.slow
@of_seeds(2, 6)
def test_pictures_hang_at_eye_level(seeds: range) -> None:
    """The middle of the first of each group is 1.45 to 1.6 m above the floor."""
    for seed in seeds:
        for body in pieces(furnished("living_room", seed)):
            if family(body) == "picture":
                assert 1.44 < np.mean(heights_m(body)) < 1.61


@pytest.mark.slow
def test_nothing_on_a_wardrobe_reaches_into_the_ceiling() -> None:
    """Bedrooms of 2.3 m, whose wardrobes carry boxes and suitcases where they fit."""
    low = Furnish(name="f", height_m=dist.Constant(2.3), clutter=dist.Constant(3.0))
    for seed in range(4):
        scene = low(nominal("bedroom"), library(), Streams(3, seed).rng("furniture"))
        assert max(heights_m(b)[1] for b in pieces(scene) if family(b) != "ceiling_lamp") < 2.3


@pytest.mark.slow
def test_an_impossible_room_says_what_has_no_place_and_what_to_change() -> None:
    """A bed of two metres does not fit a room of 1.5 m."""
    small = Furnish(name="furniture", length_m=dist.Constant(1.5), width_m=dist.Constant(1.5))
    with pytest.raises(LayoutRejected) as caught:
        small(nominal("bedroom"), library(), Streams(3, 1).rng("furniture"))

    assert "bedroom: bed: " in caught.value.rejection.reason
    assert caught.value.rejection.remedy == "a larger length_m or width_m (randomizers.furniture)"


def test_an_unknown_type_of_room_is_refused_with_the_nearest() -> None:
    """The text names the field."""
    with pytest.raises(ConfigError, match=r"elements.room.kind: .*'kichen'.*kitchen"):
        build_scene("test", (RoomLayout(name="room", kind="kichen"),), library())


def test_furnish_needs_a_room_layout() -> None:
    """A scene without one is refused."""
    with pytest.raises(ConfigError, match=r"randomizers.furniture.room: .*room_layout"):
        Furnish(name="furniture")(Scene("empty"), library(), Streams(3, 1).rng("furniture"))


@pytest.mark.parametrize(("count", "least"), [
    pytest.param(28, 100, marks=pytest.mark.slow),
    pytest.param(200, 140, marks=pytest.mark.exhaustive),
])  # fmt: skip
def test_no_two_rooms_are_nearly_alike_and_many_categories_occur(count: int, least: int) -> None:
    """Sets of (family, place to 0.25 m) share less than a quarter."""
    kinds = [k for k in KINDS if k != "apartment"]
    scenes = [(kinds[k % len(kinds)], furnished(kinds[k % len(kinds)], k)) for k in range(count)]
    cells = [
        (
            kind,
            {
                (family(b), *(round(4 * v) for v in b.T_world_body.translation_m[:2]))
                for b in pieces(scene)
            },
        )
        for kind, scene in scenes
    ]
    alike = [len(a & b) / len(a | b) for (k, a), (m, b) in combinations(cells, 2) if k == m]
    categories = {i.category for _, scene in scenes for i in scene.instances} - STRUCTURE

    assert max(alike) < 0.25
    assert len(categories) >= least


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "seed"), [("living_room", 20), ("workshop", 11), ("office", 2), ("kitchen", 3)]
)
def test_things_keep_clear_of_the_sills_of_windows(kind: str, seed: int) -> None:
    """Sills stand out of walls, and are wider than their windows. Walls are along the axes."""
    scene = furnished(kind, seed)
    sills = []
    for body in scene.bodies:
        if family(body) == "window":
            mesh = library().mesh(body.asset)
            corners = mesh.vertices_m[mesh.faces[mesh.face_slots == 1].ravel()]
            world = body.T_world_body.apply(corners.astype(np.float64))
            sills.append((world.min(axis=0) + 0.002, world.max(axis=0) - 0.002))

    assert sills
    for body in scene.bodies:
        if body.collides and family(body) not in {"window", "wall"}:
            points = world_vertices(body)
            for low, high in sills:
                assert not ((points > low) & (points < high)).all(axis=1).any(), body.name
