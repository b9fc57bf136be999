"""Fields along a road: parcels of crops in rows, headlands, tracks between them."""

import math
from collections.abc import Iterator
from itertools import cycle, pairwise

import numpy as np

from gen_data.assets.family import Solid, check_option
from gen_data.content.procedural.patches import Array, Patch, join_patches, make_solid_in_place
from gen_data.content.roads import deck, lane_textures
from gen_data.content.roads.crop_textures import CROP_TILE_M, CROPS, STAND_TILE_M
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, variant_rng
from gen_data.roads.alignment import curvature_range
from gen_data.roads.fields_shape import TRACK_M, FieldsShape, Parcel

HEIGHTS_M = {"maize": 2.3, "wheat": 0.82, "rape": 1.4}
"""Standing crops; others lie flat (in flower or ripe: maize 2 to 3 m, winter wheat 0.7 to 1 m, rape
1.2 to 1.7 m; assumed, 10 %)."""
_HEADLAND_M, _STEP_M = 9.0, 0.8
_TRAMLINES = {"wheat": 18.0, "rape": 18.0, "seedlings": 18.0, "maize": 0.0}
"""Distance of the sprayer's tracks [m], a multiple of the drill's 3 m (assumed); 0 = none."""
_TRACK_LIFT_M = 0.015


def fields(**shape: float | str) -> Solid:
    """Fields in the frame of their road, level at z = 0; the road's shoulder is below.

    Args:
        shape: Fields of ``FieldsShape``.

    Raises:
        AssetError: a crop is unknown.
    """
    plan = FieldsShape(**shape)  # type: ignore[arg-type]
    for word in plan.crops.split("_"):
        check_option("fields", "crops", word, CROPS)
    rng = variant_rng("fields/stand", plan.seed)
    parcels = plan.parcels()
    slots = _number_slots(parcels)
    patches: list[Patch] = []
    for number, parcel in enumerate(parcels):
        high = HEIGHTS_M.get(parcel.crop, 0.0) * rng.between(0.9, 1.1)
        patches += _cover(plan, parcel, high, slots)
        if high:
            patches += _edges(plan, parcel, high, slots, rng)
        after = parcels[number + 1].start_m if number + 1 < len(parcels) else parcel.end_m
        if after > parcel.end_m:
            patches.append(_track(plan, parcel.end_m, slots["track"]))
    slab = _slab(plan)
    return make_solid_in_place([join_patches(patches)], tuple(_materials(slots, plan.seed)), [slab])


def _number_slots(parcels: tuple[Parcel, ...]) -> dict[str, int]:
    """Number of each material by name: crops, edges of standing crops, tracks."""
    crops = list(dict.fromkeys(parcel.crop for parcel in parcels))
    names = [*crops, *(f"{word}/edge" for word in crops if word in HEIGHTS_M)]
    if any(_TRAMLINES.get(word) for word in crops):
        names.append("tramline")
    if any(a.end_m < b.start_m for a, b in pairwise(parcels)):
        names.append("track")
    return {name: k for k, name in enumerate(names)}


def _materials(slots: dict[str, int], seed: int) -> Iterator[Material]:
    for name in slots:
        word, _, edge = name.partition("/")
        if name == "track":
            texture = f"texture/track_lane?material=earth&seed={seed % 4}"
            yield Material(roughness=0.97, texture=texture, role="grass")
        elif name == "tramline":
            yield Material((0.09, 0.075, 0.055), roughness=0.97, role="grass")
        else:
            texture = f"texture/{'crop_edge' if edge else 'crop'}?kind={word}&seed={seed % 2}"
            role = "leaf" if word in HEIGHTS_M else "grass"
            yield Material(roughness=0.95, specular=0.2, texture=texture, role=role)


def _cover(
    plan: FieldsShape, parcel: Parcel, high_m: float, slots: dict[str, int]
) -> Iterator[Patch]:
    """The field from above: its headland, its rows and the sprayer's tracks between them.

    Neighbours share the corners of their edges: no crack opens where the ground bends.
    """
    first = _STEP_M if high_m else 0.0
    rows = _rows(plan, parcel)
    crop, z_m = slots[parcel.crop], 0.95 * high_m
    pitch = _TRAMLINES.get(parcel.crop, 0.0)
    strips_of = (crop, slots["tramline"]) if pitch else (crop,)
    if parcel.across:
        cuts = _strip_edges(parcel.start_m, parcel.end_m, pitch, parcel.start_m)
        # Rows next to an edge would make slivers.
        inner = rows[np.abs(rows[:, None] - cuts).min(axis=1) > 0.02]
        rows = np.union1d(inner, cuts)
        yield _sheet(plan, rows, (first, _HEADLAND_M), z_m, crop)
        for (low, high), slot in zip(pairwise(cuts), cycle(strips_of), strict=False):
            part = rows[(rows >= low) & (rows <= high)]
            yield _sheet(plan, part, (_HEADLAND_M, plan.depth_m), z_m, slot, turned=True)
        return
    cuts = _strip_edges(first, plan.depth_m, plan.depth_m, pitch)
    for (low, high), slot in zip(pairwise(cuts), cycle(strips_of), strict=False):
        yield _sheet(plan, rows, (low, high), z_m, slot)


def _strip_edges(low_m: float, high_m: float, pitch_m: float, origin_m: float) -> Array:
    """Both ends, and between them the edges of the wheels' tracks, if there are any."""
    if not pitch_m:
        return np.array([low_m, high_m])
    middles = np.arange(origin_m + 0.5 * pitch_m, high_m - 2.0, pitch_m)
    edges = (middles[:, None] + [-1.1, -0.7, 0.7, 1.1]).ravel()
    return np.concatenate([[low_m], edges, [high_m]])


def _rows(plan: FieldsShape, parcel: Parcel) -> Array:
    """Arc lengths of the mesh's rows: two on straight roads."""
    low, high = curvature_range(plan.curvature_per_m, plan.bends, parcel.start_m, parcel.end_m)
    bend = max(-low, high)
    step = math.sqrt(8.0 * 0.05 / bend) if bend else math.inf
    count = max(1, math.ceil((parcel.end_m - parcel.start_m) / step))
    return np.linspace(parcel.start_m, parcel.end_m, count + 1)


def _sheet(
    plan: FieldsShape,
    s_m: Array,
    away_m: tuple[float, float],
    z_m: float,
    slot: int,
    *,
    turned: bool = False,
) -> Patch:
    """A level sheet; rows of its texture run along the road, or away from it if turned."""
    s, away = np.meshgrid(s_m, np.array(away_m), indexing="ij")
    uv = np.stack([s, away] if turned else [away, s], axis=2) / CROP_TILE_M
    return _laid(plan, s, away, np.full(s.shape, z_m), uv, slot)


def _laid(plan: FieldsShape, s_m: Array, away_m: Array, z_m: Array, uv: Array, slot: int) -> Patch:
    """A grid by arc length and distance, both rising, that faces up or towards the road."""
    points = np.concatenate([plan.points(s_m, away_m), z_m[..., None]], axis=2)
    if plan.side < 0.0:
        points, uv = points[:, ::-1], uv[:, ::-1]
    return deck.mapped_surface(points, uv, slot)


def _edges(
    plan: FieldsShape, parcel: Parcel, high_m: float, slots: dict[str, int], rng: VariantRng
) -> Iterator[Patch]:
    """The ragged front of a standing crop, and its two ends."""
    slot = slots[f"{parcel.crop}/edge"]
    count = max(2, round((parcel.end_m - parcel.start_m) / _STEP_M))
    s = np.linspace(parcel.start_m, parcel.end_m, count + 1)
    crest = high_m * np.array([rng.between(0.86, 1.08) for _ in s])
    foot = np.array([rng.between(0.0, 0.3) for _ in s])
    away = np.stack([foot, foot + 0.25, np.full(len(s), _STEP_M + 0.1)], axis=1)
    z = np.stack([np.full(len(s), -0.1), crest, np.full(len(s), 0.93 * high_m)], axis=1)
    u = np.broadcast_to(s[:, None] / STAND_TILE_M, away.shape)
    v = np.broadcast_to(np.array([0.0, 0.485, 0.5]), away.shape)
    yield _laid(plan, np.broadcast_to(s[:, None], away.shape), away, z, np.stack([u, v], 2), slot)
    for end, outward in ((parcel.start_m, -1.0), (parcel.end_m, 1.0)):
        across = np.linspace(0.3, plan.depth_m, 12)
        top = 0.95 * high_m * np.array([rng.between(0.95, 1.02) for _ in across])
        station = np.stack([np.full(12, end + outward * 0.2), np.full(12, end)], axis=1)
        flat = plan.points(station, np.stack([across, across], axis=1))
        heights = np.stack([np.full(12, -0.1), top], axis=1)
        points = np.concatenate([flat, heights[..., None]], axis=2)
        uv = np.stack(np.broadcast_arrays(across[:, None] / STAND_TILE_M, [[0.0, 0.485]]), axis=2)
        patch = deck.mapped_surface(points, uv, slot)
        # Seen from the road, larger arc lengths are on the right of a left field.
        yield patch if outward * plan.side > 0.0 else patch.flipped()


def _track(plan: FieldsShape, start_m: float, slot: int) -> Patch:
    """A farm track that leads away from the road."""
    s, away = np.meshgrid(
        [start_m, start_m + TRACK_M], [-1.0, 0.5 * plan.depth_m, plan.depth_m], indexing="ij"
    )
    uv = np.stack([(s - start_m) / TRACK_M, away / lane_textures.TILE_M], axis=2)
    return _laid(plan, s, away, np.full(s.shape, _TRACK_LIFT_M), uv, slot)


def _slab(plan: FieldsShape) -> Array:
    """The convex outline of the land below."""
    s, away = np.meshgrid(np.linspace(0.0, plan.length_m, 5), [0.0, plan.depth_m], indexing="ij")
    top = np.concatenate([plan.points(s, away), np.zeros((5, 2, 1))], axis=2).reshape(-1, 3)
    slab: Array = np.concatenate([top, top - np.array([0.0, 0.0, 0.3])])
    return slab
