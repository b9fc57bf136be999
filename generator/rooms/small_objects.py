"""Small objects on the level surfaces and boards of pieces."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gen_data.assets.families import declared
from gen_data.core.boxes import Rectangle, overlap_of
from gen_data.core.interfaces import AssetIndex
from gen_data.core.keypoint_names import INSIDE, SUPPORT
from gen_data.rooms import floor_plan, resting, rules
from gen_data.rooms.layout import Layout, Options, Piece, Shape, cos_sin

_BORDER_M = (0.05, 0.05)
"""Width of the border of surfaces that stays free, in depth and width."""
_SQUARE_SHARE = 0.4
"""Share of objects on tables that lie square to them."""
_TRIES_ON = 6
_FULL = 0.97
"""Largest share of a board that objects cover."""


@dataclass(frozen=True, slots=True)
class Support:
    """A level surface of a piece that carries objects.

    Attributes:
        height_m: World height.
        clearance_m: Free height above.
        middle_m, half_m: Middle and half extents of the surface in the piece's footprint.
        is_top: Whether it is the piece's top, which may be round.
    """

    height_m: float
    clearance_m: float
    middle_m: tuple[float, float]
    half_m: tuple[float, float]
    is_top: bool = False


def supports(piece: Piece, assets: AssetIndex) -> list[Support]:
    """Surfaces of a piece that carry objects."""
    height, half = piece.high_m - piece.low_m, piece.footprint[4:]
    corners = [k.position_m for k in assets.keypoints(piece.asset) if k.name == SUPPORT]
    if corners:
        (x0, y0, z), (x1, y1, _) = corners
        low, high = assets.bounds_m(piece.asset)
        middle = tuple(
            0.5 * (a + b) - 0.5 * (c + d)
            for a, b, c, d in zip((x0, y0), (x1, y1), low[:2], high[:2], strict=True)
        )
        free = (0.5 * (x1 - x0), 0.5 * (y1 - y0))
        return [Support(piece.position_m[2] + z, 0.35, (middle[0], middle[1]), free)]
    if declared(piece.family, "seat", False):
        # Seats of packs do not say where they are level.
        return []
    edge_x, edge_y = declared(piece.family, "border_m", _BORDER_M)
    inner = (half[0] - edge_x, half[1] - edge_y)
    levels_m = declared(piece.family, "levels_m", None)
    if levels_m is not None:
        levels = levels_m(round(height, 6))
        free_m = height / len(levels) - 0.05
        return [Support(piece.low_m + z, free_m, (0.0, 0.0), inner) for z in levels]
    pitch_m = declared(piece.family, "pallet_pitch_m", None)
    if pitch_m is not None:
        return [Support(k * pitch_m, pitch_m - 0.16, (0.0, 0.0), inner) for k in range(3)]
    return [Support(piece.high_m, 0.6, (0.0, 0.0), inner, is_top=True)]


def _insides(piece: Piece, assets: AssetIndex) -> list[Support]:
    corners = [k.position_m for k in assets.keypoints(piece.asset) if k.name == INSIDE]
    low, high = assets.bounds_m(piece.asset)
    made = []
    for (x0, y0, z0), (x1, y1, z1) in zip(corners[::2], corners[1::2], strict=True):
        middle = (0.5 * (x0 + x1 - low[0] - high[0]), 0.5 * (y0 + y1 - low[1] - high[1]))
        half = (0.5 * (x1 - x0), 0.5 * (y1 - y0))
        made.append(Support(piece.position_m[2] + z0, z1 - z0, middle, half))
    return made


def put_small_objects(layout: Layout, rule: rules.Rule, options: Options, clutter: float) -> None:
    """Small objects on the surfaces of all pieces of a rule, apart from one another."""
    for k, piece in enumerate(list(layout.pieces)):
        if piece.role != rule.piece or piece.on >= 0 or piece.family not in rule.assets:
            continue
        near = [
            p
            for n, p in enumerate(layout.pieces)
            if n != k and overlap_of(p.footprint, piece.footprint)
        ]
        for board in _insides(piece, layout.assets) if rule.inside else ():
            stored = _put_thing(layout, rule.inside, options, k, board, near)
            if stored is not None:
                layout.pieces.append(stored)
        for support in supports(piece, layout.assets) if rule.things else ():
            if rule.filled[1]:
                _fill_board(layout, rule, options, k, support, near, clutter)
                continue
            for _ in range(round(floor_plan.draw_count(layout.rng, rule.how_many) * clutter)):
                placed = _put_thing(layout, rule.things, options, k, support, near)
                if placed is not None:
                    layout.pieces.append(placed)
                    near.append(placed)


def _put_thing(
    layout: Layout,
    things: Sequence[str],
    options: Options,
    k: int,
    support: Support,
    near: Sequence[Piece],
) -> Piece | None:
    """An object on a surface of piece k; None if there is no place for it."""
    family = layout.pick(things)
    asset = layout.pick(options[family])
    s = layout.shape(asset)
    if not _fits(layout, s, support):
        return None
    for _ in range(_TRIES_ON):
        turn = layout.signed(math.pi if support.is_top else 0.25)
        if declared(family, "square", False) or (
            support.is_top and layout.rng.random() < _SQUARE_SHARE
        ):
            turn = 0.0
        reach = _reach(s, turn)
        free = support.half_m[0] - reach[0], support.half_m[1] - reach[1]
        if min(free) < 0.0:
            continue
        dx, dy = layout.signed(free[0]), layout.signed(free[1])
        placed = _thing_at(layout, family, asset, k, support, (dx, dy), turn)
        if not _is_taken(placed, near) and (
            not support.is_top or layout.is_on_top(placed.footprint, layout.pieces[k])
        ):
            return placed
    return None


def _fill_board(
    layout: Layout,
    rule: rules.Rule,
    options: Options,
    k: int,
    support: Support,
    near: list[Piece],
    clutter: float,
) -> None:
    """Objects side by side on a board, from one end on, near its front edge."""
    share = min(floor_plan.between(layout.rng, rule.filled) * clutter, _FULL)
    end = support.half_m[1] * (2.0 * share - 1.0)
    side = 1.0 if layout.rng.random() < 0.5 else -1.0
    at, failed = -support.half_m[1], 0
    while at < end and failed < _TRIES_ON:
        family = layout.pick(rule.things)
        asset = layout.pick(options[family])
        s = layout.shape(asset)
        turn = 0.0 if declared(family, "square", False) else layout.signed(0.12)
        reach = _reach(s, turn)
        free = support.half_m[0] - reach[0]
        if free < 0.0 or at + 2.0 * reach[1] > support.half_m[1] or not _fits(layout, s, support):
            failed += 1
            continue
        back = min(2.0 * free, 0.01 + 0.03 * float(layout.rng.random()))
        place = (free - back, side * (at + reach[1]))
        placed = _thing_at(layout, family, asset, k, support, place, turn)
        at += 2.0 * reach[1] + 0.003 + 0.05 * float(layout.rng.random()) ** 3
        if _is_taken(placed, near):
            failed += 1
            continue
        layout.pieces.append(placed)
        near.append(placed)


def _fits(layout: Layout, s: Shape, support: Support) -> bool:
    """Whether an object stands and fits below the next surface above."""
    clearance_m = min(support.clearance_m, layout.room.size_m[2] - support.height_m)
    return s.rest is not None and s.high - s.low <= clearance_m


def _reach(s: Shape, turn_rad: float) -> tuple[float, float]:
    """Half extents of a turned object along depth and width of its surface [m]."""
    c, sn = abs(math.cos(turn_rad)), abs(math.sin(turn_rad))
    return s.half_x * c + s.half_y * sn, s.half_x * sn + s.half_y * c


def _thing_at(
    layout: Layout,
    family: str,
    asset: str,
    k: int,
    support: Support,
    at_m: tuple[float, float],
    turn_rad: float,
) -> Piece:
    """An object on a surface of piece k, ``at_m`` from the surface's middle."""
    carrier, height = layout.pieces[k], support.height_m
    x, y, c, sn, _, _ = carrier.footprint
    s = layout.shape(asset)
    dx, dy = support.middle_m[0] + at_m[0], support.middle_m[1] + at_m[1]
    mx, my = x + c * dx - sn * dy, y + sn * dx + c * dy
    yaw = carrier.yaw_rad + turn_rad
    c2, s2 = cos_sin(yaw)
    footprint: Rectangle = (mx, my, c2, s2, s.half_x, s.half_y)
    px, py = mx - c2 * s.x + s2 * s.y, my - s2 * s.x - c2 * s.y
    position = (round(px, 5), round(py, 5), round(height - s.low, 5))
    rest = resting.UPRIGHT if s.rest is None else s.rest
    top = height + s.high - s.low
    return Piece("thing", family, asset, position, yaw, footprint, height, top, k, rest)


def _is_taken(thing: Piece, near: Sequence[Piece]) -> bool:
    return any(
        p.low_m < thing.high_m
        and thing.low_m < p.high_m - 1e-6
        and overlap_of(thing.footprint, p.footprint)
        for p in near
    )
