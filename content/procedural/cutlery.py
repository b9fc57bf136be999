"""Forks, knives and spoons, lying along X with the handle at -X, as on a table.

Each is a thin sheet: for every station along X, how far it reaches to both sides, how high its
middle lies, how thick it is, and how deep it is hollowed.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import STAINLESS, metal_material, plastic_material
from gen_data.content.procedural.patches import Array, Patch, join_patches, make_centred_solid
from gen_data.content.procedural.surface_shapes import fan, grid, spline
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, in_turn

Station = tuple[float, float, float, float, float, float]
"""A cross-section [mm]: place along the length (x), reach towards -Y and towards +Y, height of the
middle of the sheet (z), thickness, and how far the middle lies below the rims."""


def spoon(rng: VariantRng) -> Solid:
    """A table, dessert, coffee or serving spoon. Slots: head, handle."""
    size = in_turn((1.0, 0.86, 0.66, 1.0, 1.18), rng.seed) * rng.between(0.96, 1.04)
    wide, tail = rng.between(0.88, 1.1, "wide_scale"), rng.between(0.7, 1.35, "tail_m")
    bowl = [(-32, 3.0, 12.0, 0.5), (-22, 12.0, 9.5, 4.0), (-8, 19.5, 7.0, 7.5),
            (8, 21.0, 6.5, 8.0), (20, 17.5, 7.5, 6.5), (28, 10.5, 9.0, 3.0),
            (31.5, 4.0, 10.0, 0.5)]  # fmt: skip
    head = [(67 + x, wide * w, wide * w, z + h, 1.6, h) for x, w, z, h in bowl]
    stations = [*_handle(tail, 13.0, 36.0, rng), *head]
    return _cutlery([_sheet(stations, 40)], size, 36.0, rng)


def fork(rng: VariantRng) -> Solid:
    """A table or dessert fork with three or four tines. Slots: head, handle."""
    size = (1.0, 0.86)[rng.seed % 2] * rng.between(0.97, 1.03)
    tail, half = rng.between(0.7, 1.35, "tail_m"), 0.5 * rng.between(22.0, 27.0, "head_scale")
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


@dataclass(frozen=True, slots=True)
class KnifeStyle:
    """One kind of knife [mm]; see ``knives.yaml``.

    Attributes:
        z: Height of the blade's middle above the table.
        size: Range of the factor on everything.
        grips: Kinds of handles besides steel: ``dark``, ``bright`` or ``wood``; empty = cutlery.
    """

    handle: tuple[tuple[float, float, float, float], ...]
    blade: tuple[tuple[float, float, float, float], ...]
    z: float
    size: tuple[float, float]
    grips: tuple[str, ...] = ()


KNIVES: Mapping[str, KnifeStyle] = load_table(__package__, "knives", KnifeStyle)


def knife(rng: VariantRng) -> Solid:
    """A table or kitchen knife lying on its side, edge towards -Y. Slots: blade, handle."""
    style = KNIVES[knife_kind(rng.seed)]
    size = rng.between(*style.size)
    grip = rng.between(0.9, 1.15, "grip_scale")
    deep = rng.between(0.88, 1.1, "deep_scale")
    handle = _even(*((x, grip * wide, z, thick) for x, wide, z, thick in style.handle))
    blade = [(x, deep * low, high, style.z, thick, 0.0) for x, low, high, thick in style.blade]
    finish = _GRIPS[rng.choose(style.grips)](rng) if style.grips else None
    return _cutlery([_sheet(handle, 22), _sheet(blade, 30)], size, -3.0, rng, finish)


def knife_kind(seed: int) -> str:
    """Key in ``knives.yaml``: every other knife is a table knife."""
    return in_turn(("table", "chef", "table", "paring", "table", "steak", "butter", "bread"), seed)


def knife_facts(seed: int) -> Facts:
    """Kind of knife."""
    return Facts(knife_kind(seed))


def _wood(rng: VariantRng) -> Material:
    texture, tint = f"texture/wood_grain?seed={int(rng.between(0, 18))}", rng.between(0.5, 1.0)
    return Material((tint, tint, tint), 0.55, texture=texture, texture_scale_m=0.12, printed=True)


_GRIPS: Mapping[str, Callable[[VariantRng], Material]] = {
    "dark": lambda rng: plastic_material(rng, ("#151516", "#202124", "#2a2c30")),
    "bright": plastic_material,
    "wood": _wood,
}


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


def _cutlery(
    sheets: list[Patch], size: float, cut_mm: float, rng: VariantRng, grip: Material | None = None
) -> Solid:
    """The finished piece: scaled to metres, slot 1 behind the cut, collision in slices."""
    scale = 0.001 * size
    patch = join_patches(sheets)
    behind = patch.corners_m.mean(axis=1)[:, 0] < cut_mm - 6.0
    patch = Patch(patch.corners_m * scale, patch.uvs, behind.astype(np.int64))
    head, handle = _finishes(rng)
    low, high = patch.bounds_m()
    edges = np.linspace(float(low[0]), float(high[0]), 8)
    parts = [hulls.extreme(_slice(patch, a, b)) for a, b in pairwise(edges.tolist())]
    return make_centred_solid([patch], (head, grip or handle), parts)


def _finishes(rng: VariantRng) -> tuple[Material, Material]:
    """Materials of head and handle; shares are assumed, within 10 %."""
    steel = metal_material(STAINLESS, rng.between(0.1, 0.34))
    share = rng.between(0.0, 1.0)
    if share < 0.66:
        return steel, steel
    if share < 0.82:
        return steel, plastic_material(rng)
    if share < 0.88:
        return steel, _wood(rng)
    if share < 0.94:
        white = plastic_material(rng, ("#f0f0ec", "#f0f0ec", "#202124", "#e8e4da"))
        return white, white
    plated = metal_material(rng.choose(_PLATED), rng.between(0.15, 0.3))
    return plated, plated


# Gold, copper and black coatings of steel: linear RGB.
_PLATED: tuple[Vec3, ...] = ((0.9, 0.68, 0.32), (0.8, 0.5, 0.36), (0.05, 0.05, 0.055))


def _slice(patch: Patch, a: float, b: float) -> Array:
    """Vertices of the triangles that reach into a range of x, cut off at its ends."""
    x = patch.corners_m[:, :, 0]
    touched = patch.corners_m[(x.max(axis=1) > a) & (x.min(axis=1) < b)].reshape(-1, 3)
    margin = 0.004
    inside: Array = touched[(touched[:, 0] > a - margin) & (touched[:, 0] < b + margin)]
    return inside
