"""Forks, knives and spoons, lying along X with the handle at -X, as on a table.

Each is a thin sheet: for every station along X, how far it reaches to both sides, how high its
middle lies, how thick it is, and how deep it is hollowed.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from gen_data.generator.assets.procedural import collision_hulls as hulls
from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.material_presets import (
    STAINLESS,
    metal_material,
    plastic_material,
)
from gen_data.generator.assets.procedural.patches import (
    Array,
    Patch,
    join_patches,
    make_centred_solid,
)
from gen_data.generator.assets.procedural.surface_shapes import fan, grid, spline
from gen_data.generator.assets.procedural.variant_rng import VariantRng, variant_rng
from gen_data.generator.core.asset_types import Material

Station = tuple[float, float, float, float, float, float]
"""A cross-section [mm]: place along the length (x), reach towards -Y and towards +Y, height of the
middle of the sheet (z), thickness, and how far the middle lies below the rims."""


def spoon(seed: int) -> Solid:
    """A table, dessert or coffee spoon. Slots: head, handle."""
    rng = variant_rng("spoon", seed)
    size = (1.0, 0.86, 0.66)[seed % 3] * rng.between(0.96, 1.04)
    wide, tail = rng.between(0.93, 1.07), rng.between(0.85, 1.2)
    bowl = [(-32, 3.0, 12.0, 0.5), (-22, 12.0, 9.5, 4.0), (-8, 19.5, 7.0, 7.5),
            (8, 21.0, 6.5, 8.0), (20, 17.5, 7.5, 6.5), (28, 10.5, 9.0, 3.0),
            (31.5, 4.0, 10.0, 0.5)]  # fmt: skip
    head = [(67 + x, wide * w, wide * w, z + h, 1.6, h) for x, w, z, h in bowl]
    stations = [*_handle(tail, 13.0, 36.0, rng), *head]
    return _cutlery([_sheet(stations, 40)], size, 36.0, rng)


def fork(seed: int) -> Solid:
    """A table or dessert fork with three or four tines. Slots: head, handle."""
    rng = variant_rng("fork", seed)
    size = (1.0, 0.86)[seed % 2] * rng.between(0.97, 1.03)
    tail, half = rng.between(0.85, 1.2), rng.between(11.5, 13.0)
    count = 3 if rng.chance(0.25) else 4
    head = [(40, 4.0, 4.0, 14.5, 2.2, 0.0), (48, 10.5, 10.5, 12.0, 2.0, 1.0),
            (56, half, half, 9.0, 1.9, 2.0), (63, half, half, 6.0, 1.9, 2.0)]  # fmt: skip
    root = _sheet([*_handle(tail, 15.5, 32.0, rng), *head], 36)
    pitch = 2 * half / (count - 0.36)
    tines = []
    for i in range(count):
        middle = (i - 0.5 * (count - 1)) * pitch
        w = 0.32 * pitch
        # The tines continue the head's curve across, and rise again towards their tips.
        lift = 2.0 * (middle / half) ** 2 - 2.0
        line = [(60, 7.3, w), (75, 3.6, 0.97 * w), (90, 3.0, 0.9 * w), (104, 5.2, 0.72 * w),
                (110, 7.0, 0.25 * w)]  # fmt: skip
        rows = [(x, a - middle, a + middle, z + lift + 2.0, 1.8, 0.0) for x, z, a in line]
        tines.append(_sheet(rows, 10, 2))
    return _cutlery([root, *tines], size, 36.0, rng)


def knife(seed: int) -> Solid:
    """A table knife lying on its side, edge towards -Y. Slots: blade, handle."""
    rng = variant_rng("knife", seed)
    size = rng.between(0.94, 1.06)
    grip, tip = rng.between(0.9, 1.15), rng.between(0.0, 5.0)
    wide, middle = 8.0 * grip, 8.8 * grip
    handle = _even((-112, 3.0, 3.2, 3.4), (-108, wide, 3.4, 5.0), (-80, middle, 3.6, 6.4),
                   (-40, wide, 3.6, 6.2), (-8, 6.6, 3.4, 5.4), (-2, 6.2, 3.2, 4.2))  # fmt: skip
    blade = [(-4, 6.0, 6.0, 3.0, 2.4, 0.0), (4, 7.5, 7.0, 3.0, 1.8, 0.0),
             (30, 11.0, 8.5, 3.0, 1.5, 0.0), (70, 11.5, 9.0, 3.0, 1.3, 0.0),
             (95, 9.0 - tip, 9.0, 3.0, 1.2, 0.0), (107, 2.0 - tip, 8.0, 3.0, 1.1, 0.0),
             (112, -4.5, 6.0, 3.0, 1.0, 0.0)]  # fmt: skip
    return _cutlery([_sheet(handle, 22), _sheet(blade, 26)], size, -3.0, rng)


def _handle(tail: float, neck_z: float, neck_x: float, rng: VariantRng) -> list[Station]:
    """From the broad end on the table to the slender raised neck."""
    end = rng.between(8.0, 10.5) * tail
    return _even((-98, 0.35 * end, 3.4, 1.4), (-95, 0.75 * end, 3.0, 1.9), (-84, end, 2.6, 2.2),
                 (-45, 0.66 * end, 4.5, 2.4), (0, 3.6, 0.75 * neck_z, 2.9),
                 (neck_x - 10, 2.7, neck_z, 3.1))  # fmt: skip


def _even(*rows: tuple[float, float, float, float]) -> list[Station]:
    """Flat stations that reach as far to both sides."""
    return [(x, w, w, z, thick, 0.0) for x, w, z, thick in rows]


def _sheet(stations: Sequence[Station], count: int, across: int = 6) -> Patch:
    """The closed surface of a sheet through the stations [mm], rounded at its rims."""
    line = spline(stations, count)
    x, right, left, z, thick, hollow = (line[:, i : i + 1] for i in range(6))
    side = np.linspace(1.0, -1.0, across + 1)[None, :]
    y = 0.5 * (left - right) + 0.5 * (left + right) * side
    middle = z - hollow * (1.0 - side**2)
    half = 0.5 * np.maximum(thick, 0.6) * np.sqrt(np.maximum(1.0 - 0.93 * side**4, 0.0))
    xs = np.broadcast_to(x, y.shape)
    top, bottom = (np.stack([xs, y, middle + s * half], axis=2) for s in (1.0, -1.0))
    loop = np.concatenate([top, bottom[:, ::-1], top[:, :1]], axis=1)
    return join_patches([grid(loop), fan(loop[0, :0:-1]), fan(loop[-1, :-1])])


def _cutlery(sheets: list[Patch], size: float, cut_mm: float, rng: VariantRng) -> Solid:
    """The finished piece: scaled to metres, slot 1 behind the cut, collision in slices."""
    scale = 0.001 * size
    patch = join_patches(sheets)
    behind = patch.corners_m.mean(axis=1)[:, 0] < cut_mm - 6.0
    patch = Patch(patch.corners_m * scale, patch.uvs, behind.astype(np.int64))
    steel = metal_material(STAINLESS, rng.between(0.12, 0.28))
    handle: Material = plastic_material(rng) if rng.chance(0.2) else steel
    low, high = patch.bounds_m()
    edges = np.linspace(float(low[0]), float(high[0]), 8)
    parts = [hulls.extreme(_slice(patch, a, b)) for a, b in pairwise(edges.tolist())]
    return make_centred_solid([patch], (steel, handle), parts)


def _slice(patch: Patch, a: float, b: float) -> Array:
    """Vertices of the triangles that reach into a range of x, cut off at its ends."""
    x = patch.corners_m[:, :, 0]
    touched = patch.corners_m[(x.max(axis=1) > a) & (x.min(axis=1) < b)].reshape(-1, 3)
    margin = 0.004
    inside: Array = touched[(touched[:, 0] > a - margin) & (touched[:, 0] < b + margin)]
    return inside
