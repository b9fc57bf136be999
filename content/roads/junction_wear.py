"""Traces of age and use on a junction: lanes through it, mended patches, sealed cracks, gutters."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gen_data.content.procedural.patches import Array, Patch
from gen_data.content.roads import deck, lane_textures, painted_signs, road_materials, road_wear
from gen_data.core.variant_rng import VariantRng, variant_rng
from gen_data.roads.junction_shape import ArmsShape, Fan, JunctionShape, corner, lane_middle_m

_LANE_LIFT_M, _SEAM_LIFT_M, _MEND_LIFT_M, _GUTTER_LIFT_M = 0.0006, 0.0012, 0.0018, 0.0015
Span = tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Frame:
    """A frame on the plan of a junction: its origin [m] and the direction of its X."""

    x_m: float
    y_m: float
    turn_rad: float

    def local(self, xy: Array) -> Array:
        """Points [..., 2] of the junction in this frame."""
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        moved: Array = (xy - np.array([self.x_m, self.y_m])) @ np.array([[c, -s], [s, c]])
        return moved


def worn_surface(
    shape: JunctionShape, fan: Fan, look: road_materials.StreetLook, slots: dict[str, int]
) -> Iterator[Patch]:
    """All traces on the carriageway of a junction."""
    yield from _lanes(shape, fan, slots)
    if look.carriageway in road_materials.UNPAVED:
        return
    rng = variant_rng("junction/wear", look.seed)
    reach = shape.curve_end_m()
    for _ in range(round(look.wear * (2.0 + 0.5 * reach))):
        yield from _mend(fan, reach, slots, rng)
    for _ in range(round(look.wear * (3.0 + 0.4 * reach))):
        yield from _crack(fan, reach, slots, rng)
    if look.carriageway == "asphalt" and shape.kerb_m > 0.0:
        for number in range(len(shape.arms_rad())):
            yield gutter_band(shape, number, slots["gutter"])


def _lanes(shape: JunctionShape, fan: Fan, slots: dict[str, int]) -> Iterator[Patch]:
    """Lanes along the arms; the first two arms in line are a road that goes on between them."""
    arms, reach, start = shape.arms_rad(), shape.reach_m(), shape.curve_end_m()
    done: set[int] = set()
    for number, arm in enumerate(arms):
        opposite = [
            k for k, v in enumerate(arms) if abs(math.remainder(v - arm, math.tau)) > math.pi - 1e-3
        ]
        if number in done:
            continue
        through = bool(opposite) and not done
        done |= {number, *opposite} if through else set()
        frame = _Frame(0.0, 0.0, arm)
        spans = [(-reach, reach)] if through else [(start, reach)]
        for low, high in _strips(shape):
            for span in spans:
                yield from _laid(fan, frame, (span, (low, high)), slots["lane"], _LANE_LIFT_M,
                                 lane_m=high - low)  # fmt: skip


def _strips(shape: JunctionShape) -> Iterator[Span]:
    """Edges of all lanes of an arm, and of the strip between the directions."""
    if shape.median_m > 0.0:
        yield (-0.5 * shape.median_m, 0.5 * shape.median_m)
    for lane in range(shape.lanes):
        for way in (1.0, -1.0):
            middle, half = way * lane_middle_m(shape, lane), 0.5 * shape.lane_width_m
            yield (middle - half, middle + half)


def _mend(fan: Fan, reach_m: float, slots: dict[str, int], rng: VariantRng) -> Iterator[Patch]:
    """A rectangle of newer asphalt within a seam of bitumen."""
    frame = _draw_frame(reach_m, rng)
    half = (0.5 * rng.between(0.8, 4.0), 0.5 * rng.between(0.6, 1.5))
    outer = ((-half[0], half[0]), (-half[1], half[1]))
    inner = tuple((low + 0.025, high - 0.025) for low, high in outer)
    yield from _laid(fan, frame, outer, slots["tar"], _SEAM_LIFT_M)
    yield from _laid(fan, frame, (inner[0], inner[1]), slots["asphalt_new"], _MEND_LIFT_M)


def _crack(fan: Fan, reach_m: float, slots: dict[str, int], rng: VariantRng) -> Iterator[Patch]:
    """A sealed crack that wanders, in pieces of about a metre."""
    frame, half = _draw_frame(reach_m, rng), 0.5 * rng.between(0.015, 0.045)
    for _ in range(2 + int(rng.between(0.0, 5.0))):
        length = rng.between(0.5, 1.4)
        area = ((-half, length + half), (-half, half))
        yield from _laid(fan, frame, area, slots["tar"], _MEND_LIFT_M + 0.0002)
        c, s = math.cos(frame.turn_rad), math.sin(frame.turn_rad)
        turned = frame.turn_rad + rng.between(-0.6, 0.6)
        frame = _Frame(frame.x_m + length * c, frame.y_m + length * s, turned)


def _draw_frame(reach_m: float, rng: VariantRng) -> _Frame:
    """A place anywhere within a reach, mostly aligned with the arms."""
    turn = 0.5 * math.pi * int(rng.between(0.0, 4.0)) + rng.between(-0.12, 0.12)
    return _Frame(rng.between(-reach_m, reach_m), rng.between(-reach_m, reach_m), turn)


def _laid(
    fan: Fan,
    frame: _Frame,
    area_m: tuple[Span, Span],
    slot: int,
    lift_m: float,
    *,
    lane_m: float = 0.0,
) -> Iterator[Patch]:
    """The part of a rectangle that lies on the carriageway, cut along the carriageway's edges.

    Args:
        fan: Carriageway.
        frame: Frame of the rectangle.
        area_m: The rectangle, along X and Y of the frame.
        slot: Material.
        lift_m: Height over the carriageway.
        lane_m: Width over which the texture of a lane fits once; 0 = a texture of the ground.
    """
    x_m, y_m = area_m
    triangles = _triangles(fan)
    local = frame.local(triangles[..., :2])
    low, high = local.min(axis=1), local.max(axis=1)
    near = (low < [x_m[1], y_m[1]]).all(axis=1) & (high > [x_m[0], y_m[0]]).all(axis=1)
    if not near.any():
        return
    # A triangle is flat: its own corners give the heights and places of all points on it.
    shares = np.linalg.inv(local[near, 1:] - local[near, :1])
    edges = shares @ (triangles[near, 1:] - triangles[near, :1])
    feet = triangles[near, 0] + np.array([0.0, 0.0, lift_m])
    for foot, edge, plan in zip(feet, edges, local[near], strict=True):
        piece = painted_signs.clip_convex(painted_signs.clip_convex(plan, 0, *x_m), 1, *y_m)
        if len(piece) < 3:
            continue
        points = foot + (piece - plan[0]) @ edge
        if lane_m > 0.0:
            u = (piece[:, 1] - y_m[0]) / lane_m
            uv = np.column_stack(
                [u if y_m[0] < 0.0 else 1.0 - u, piece[:, 0] / lane_textures.TILE_M]
            )
        else:
            uv = piece / road_materials.SCALES_M["asphalt_new"]
        count = len(piece) - 2
        index = np.stack(
            [np.zeros(count, int), np.arange(1, count + 1), np.arange(2, count + 2)], 1
        )
        yield Patch(points[index], uv[index], np.full(count, slot, dtype=np.int64))


def _triangles(fan: Fan) -> Array:
    """Triangles of a carriageway, [n, 3 corners, 3]."""
    center = np.broadcast_to([0.0, 0.0, fan.center_z_m], fan.outline_m.shape)
    made: Array = np.stack([center, fan.outline_m, np.roll(fan.outline_m, -1, axis=0)], axis=1)
    return made


def gutter_band(shape: ArmsShape, number: int, slot: int) -> Patch:
    """Dirt along the kerb of a corner: half its texture from the clean surface to the kerb."""
    lines = [corner(shape, number, -road_wear.GUTTER_M), corner(shape, number, 0.0)]
    steps = np.sqrt((np.diff(lines[1], axis=0) ** 2).sum(axis=1))
    along = np.concatenate([[0.0], np.cumsum(steps)]) / road_materials.SCALES_M["gutter"]
    plan = np.stack(lines[::-1], axis=1)
    z = shape.height_m(plan.reshape(-1, 2)).reshape(plan.shape[:2]) + _GUTTER_LIFT_M
    uv = np.stack(np.broadcast_arrays(np.array([[0.5, 0.0]]), along[:, None]), axis=2)
    return deck.mapped_surface(np.concatenate([plan, z[..., None]], axis=2), uv, slot)
