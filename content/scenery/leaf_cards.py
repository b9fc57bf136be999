"""Foliage as cards: rectangles that show a tile of a texture with holes between its leaves.

A card's front faces outward and its normals lean away from the middle of its crown: a crown is lit
as a whole. Its texture has ``TILES`` by ``TILES`` tiles (``textures.leaves``).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.content.procedural.patches import GRID_M, Array, Indices, round_values, unit
from gen_data.content.scenery.foliage import Sprays, directions
from gen_data.content.scenery.textures.leaves import TILES
from gen_data.core import colorimetry, noise
from gen_data.core.asset_types import Material, MeshData
from gen_data.core.se3 import Vec3
from gen_data.core.streams import Rng


@dataclass(frozen=True, eq=False, slots=True)
class Cards:
    """Cards of foliage.

    Attributes:
        foot_m: Middle of each card's lower edge, [n, 3].
        along: Unit direction from there to the upper edge, [n, 3].
        across: Unit direction of the lower edge, [n, 3].
        outward: Unit direction away from the crown's middle, [n, 3].
        length_m: Distance from the lower to the upper edge, [n].
        width_m: Length of the lower edge, [n].
        slots: Material of each, [n].
    """

    foot_m: Array
    along: Array
    across: Array
    outward: Array
    length_m: Array
    width_m: Array
    slots: Indices


def card_mesh(cards: Cards, materials: Sequence[Material], softness: float, rng: Rng) -> MeshData:
    """Two triangles per card; nothing reaches below the ground.

    Args:
        cards: The cards.
        materials: One per slot.
        softness: Share of the outward direction in a card's normals; the rest is its own.
        rng: Draws the tile of each card.
    """
    n = len(cards.slots)
    half = 0.5 * cards.width_m[:, None] * cards.across
    tip = cards.foot_m + cards.length_m[:, None] * cards.along
    rim = [cards.foot_m - half, cards.foot_m + half, tip + half, tip - half]
    corners = np.stack(rim, axis=1)
    own = np.cross(cards.across, cards.along)
    inward = (own * cards.outward).sum(axis=1) < 0.0
    tile = np.floor(noise.uniform((n, 2), rng) * TILES) / TILES
    local = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]) / TILES
    uvs = tile[:, None, :] + local[None]
    # The front faces outward: two corners change places, and their texture coordinates with them.
    corners[inward], uvs[inward] = corners[inward][:, ::-1], uvs[inward][:, ::-1]
    corners[..., 2] = np.maximum(corners[..., 2], 0.0)
    corners = np.round(round_values(corners) / GRID_M) * GRID_M
    own = unit(np.where(inward[:, None], -own, own))
    normals = unit(softness * cards.outward + (1.0 - softness) * own)
    faces = (4 * np.arange(n)[:, None] + np.array([0, 1, 2, 0, 2, 3])).reshape(-1, 3)
    return MeshData(
        vertices_m=corners.reshape(-1, 3).astype(np.float32),
        faces=faces.astype(np.int32),
        normals=(np.round(round_values(np.repeat(normals, 4, axis=0)), 6) + 0.0).astype(np.float32),
        uvs=np.round(uvs.reshape(-1, 2), 6).astype(np.float32),
        face_slots=np.repeat(cards.slots, 2).astype(np.int32),
        materials=tuple(materials),
    )


def cards_about(
    at_m: Array, outward: Array, size_m: Array, slots: Indices, upright: float, rng: Rng
) -> Cards:
    """Cards with their middle at points, turned about the outward direction.

    Args:
        at_m: Middles, [n, 3].
        outward: Unit directions away from the crown's middle, [n, 3].
        size_m: Sides, [n].
        slots: Materials, [n].
        upright: From 0 = turned by chance to 1 = all grow upwards as far as ``outward`` allows.
        rng: Draws directions.
    """
    n = len(at_m)
    wild = 2.0 * noise.uniform((n, 3), rng) - 1.0
    facing = unit(outward + 0.75 * (2.0 * noise.uniform((n, 3), rng) - 1.0))
    along = upright * np.array([0.0, 0.0, 1.0]) + (1.0 - upright) * wild
    along = unit(along - (along * facing).sum(axis=1, keepdims=True) * facing + 1e-6)
    across = unit(np.cross(along, facing))
    foot = at_m - 0.5 * size_m[:, None] * along
    return Cards(foot, along, across, unit(outward), size_m, size_m, slots)


def join_cards(parts: Sequence[Cards]) -> Cards:
    """All cards as one."""
    names = [field.name for field in fields(Cards)]
    joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return Cards(**joined)


def spray_cards(sprays: Sprays, rng: Rng) -> Cards:
    """A card per spray, turned about its own axis by chance."""
    aside = sprays.outward + 0.9 * directions(len(sprays.slots), rng)
    across = unit(np.cross(sprays.along, aside))
    size = sprays.length_m
    return Cards(sprays.at_m, sprays.along, across, sprays.outward, size, size, sprays.slots)


def first_cards(cards: Cards, count: int) -> Cards:
    """The first of the cards."""
    return Cards(**{field.name: getattr(cards, field.name)[:count] for field in fields(Cards)})


BROAD: Vec3 = (0.6, 0.75, 0.1)
"""Diffuse transmittance of a broad leaf, as shares of its colour (``transmitting``).

PROSPECT-5 (Jacquemoud and Baret, "PROSPECT: a model of leaf optical properties spectra", Remote
Sensing of Environment 34, 1990; Feret et al. 2008) gives leaves of 40 ug/cm^2 of chlorophyll the
transmittance (0.07, 0.12, 0.00) and a diffuse reflectance of half as much, in linear sRGB under
6500 K. Colours of crowns are two to three times as bright as such leaves, since they include
interreflection between leaves; these shares of their mean (0.11, 0.15, 0.04) give the model's
transmittance. Between 25 and 60 ug/cm^2 it is 1.6 to 0.4 times as much."""
_TOUGH: Vec3 = (0.3, 0.4, 0.05)
"""The same of leathery leaves: PROSPECT-5, 60 ug/cm^2 of chlorophyll and a thick mesophyll."""
_NEEDLE: Vec3 = (0.15, 0.2, 0.0)
"""The same of needles and scales: PROSPECT-5 with 2.6 layers, (0.02, 0.03, 0.00)."""
_GRASS: Vec3 = (0.6, 0.75, 0.15)
"""Of blades of grass; straw has as much, since cellulose absorbs little."""
PETAL: Vec3 = (0.4, 0.4, 0.4)
"""Petals transmit nearly as much as they reflect (van der Kooi et al., "How to colour a flower",
Proceedings of the Royal Society B 283, 2016); the value is lower because petals overlap. Assumed
within 0.2."""
_TISSUES: Mapping[str, Vec3] = {
    "needle": _NEEDLE,
    "pine": _NEEDLE,
    "pine_clump": _NEEDLE,
    "scale": _NEEDLE,
    "ivy": _TOUGH,
    "blades": _GRASS,
    "blossom": PETAL,
    "twigs": (0.0, 0.0, 0.0),
}


def transmitting(leaf: Material, shares: Vec3) -> Material:
    """The material with a diffuse transmittance in shares of its colour."""
    r, g, b = (c * share for c, share in zip(leaf.base_color, shares, strict=True))
    return replace(leaf, diffuse_transmission=(r, g, b))


def leaf_material(kind: str, color: str, level: float = 1.0, warm: float = 1.0) -> Material:
    """Leaves of ``textures.leaves`` in an sRGB colour.

    Args:
        kind: Kind of leaves.
        color: ``#rrggbb`` of a leaf in full tone.
        level: Factor on brightness.
        warm: Factor on red.
    """
    r, g, b = hex_to_linear(color)
    tint: Vec3 = (min(level * warm * r, 1.0), min(level * g, 1.0), min(level * b, 1.0))
    texture = f"texture/leaves?kind={kind}&seed=0"
    leaf = Material(tint, roughness=0.75, specular=0.35, texture=texture, role="leaf")
    return transmitting(leaf, _TISSUES.get(kind, BROAD))


def crown_shades(
    kind: str, codes: Sequence[str], level: float = 1.0, warm: float = 1.0
) -> tuple[Material, ...]:
    """Leaves from a crown's depth to its surface; arguments as for ``leaf_material``."""
    levels = [level * factor for factor in depth_levels(codes)]
    return tuple(leaf_material(kind, code, k, warm) for code, k in zip(codes, levels, strict=True))


def depth_levels(codes: Sequence[str]) -> list[float]:
    """Factors that make all colours of a crown as bright as the last, its surface colour.

    Leaves deep in a crown are dark for lack of light, which renderers compute; their reflectance is
    assumed equal.
    """
    levels = colorimetry.luminance(np.array([hex_to_linear(code) for code in codes]))
    return [float(k) for k in np.round(levels[-1] / levels, 6)]


def drop_unused_slots(mesh: MeshData) -> MeshData:
    """The mesh without materials that no face uses."""
    used, numbers = np.unique(mesh.face_slots, return_inverse=True)
    materials = tuple(mesh.materials[k] for k in used.tolist())
    return replace(mesh, face_slots=numbers.reshape(-1).astype(np.int32), materials=materials)
