"""Traffic signs: shaped plates on poles, their faces drawn by ``textures.sign_faces``.

Shapes and meanings: Vienna Convention on Road Signs and Signals, 1968. Sizes: German VwV-StVO,
size 2 (discs of 600 mm, triangles with sides of 900 mm). Faces point to +X.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from gen_data.assets.family import Facts, Solid, choose_option
from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import painted_material, printed_material
from gen_data.content.procedural.patches import Array, Patch, join_patches, unit
from gen_data.content.procedural.surface_shapes import circle, grid
from gen_data.content.scenery.basic_shapes import make_solid, post
from gen_data.content.scenery.street_furniture import GALVANISED
from gen_data.core.variant_rng import variant_rng

Shape = Literal["disc", "octagon", "triangle", "yield", "diamond", "square", "wide"]
Kind = Literal["regulatory", "mandatory", "warning", "information"]


@dataclass(frozen=True, slots=True)
class Sign:
    """One kind of sign.

    Attributes:
        shape: Outline of the plate.
        kind: Group in the convention.
        face: Steps of drawing the face, see ``signs.yaml``.
        size_m: Width of the square that the image fills.
    """

    shape: Shape
    kind: Kind
    face: tuple[Any, ...]
    size_m: float = 0.6


SIGNS = load_table(__package__, "signs", Sign)

_THICK_M = 0.004
_ROOT3 = math.sqrt(3.0)


def traffic_sign(seed: int, sign: str) -> Solid:
    """A sign on its pole; ``sign`` ``any`` leaves the choice to the seed. Slots: face, back, pole.

    Raises:
        AssetError: for an unknown sign.
    """
    name = sign_name(seed, sign)
    made = SIGNS[name]
    rng = variant_rng("traffic_sign", seed)
    outline = plate_outline(made.shape) * made.size_m
    half_high = float(outline[:, 1].max())
    foot = float(-outline[:, 1].min())
    # Over a pavement the lower edge is 2.0-2.2 m high: people walk below.
    centre_z = rng.between(2.0, 2.2, "lower_edge_m") + foot
    face = _plate(outline, made.size_m).moved(0.045, 0.0, centre_z)
    pole = post(0.03, (0.0, centre_z + half_high - 0.02), sides=10).painted(2)
    texture = f"texture/traffic_sign?seed={seed % 3}&sign={name}"
    image = replace(printed_material(texture, 0.35), role="sign")
    hull = hulls.frustum((0.03, 0.0), (0.03, centre_z + half_high - 0.02), 8)
    return make_solid([face, pole], (image, painted_material("#8c8f90", 0.6), GALVANISED), [hull])


def traffic_sign_facts(seed: int, sign: str) -> Facts:
    """Its group, and which sign it is."""
    name = sign_name(seed, sign)
    return Facts(SIGNS[name].kind, {"sign": name})


def sign_name(seed: int, sign: str) -> str:
    """The name of a sign; by seed for ``any``. Raises AssetError for an unknown one."""
    return choose_option("traffic_sign", "sign", sign, tuple(SIGNS), seed)


def plate_outline(shape: Shape) -> Array:
    """Counter-clockwise outline within a unit square about the origin (right, up), [n, 2]."""
    if shape == "octagon":
        return circle(0.5 / math.cos(math.pi / 8), 8, phase=0.5)
    if shape in ("triangle", "yield"):
        sign = 1.0 if shape == "triangle" else -1.0
        height = 0.5 * _ROOT3
        corners = np.array([(-0.5, -0.5 * height), (0.5, -0.5 * height), (0.0, 0.5 * height)])
        return _round_corners(corners * np.array([1.0, sign]), 0.045)[:: round(sign)]
    if shape == "diamond":
        return _round_corners(np.array([(0.5, 0.0), (0.0, 0.5), (-0.5, 0.0), (0.0, -0.5)]), 0.04)
    if shape in ("square", "wide"):
        high = 0.5 if shape == "square" else 0.15
        corners = np.array([(-0.5, -high), (0.5, -high), (0.5, high), (-0.5, high)])
        return _round_corners(corners, 0.03)
    return circle(0.5, 28)


def _plate(outline: Array, size_m: float) -> Patch:
    """A thin plate whose front shows the image; slot 0 in front, 1 at rim and back."""
    front = np.concatenate([np.full((len(outline), 1), _THICK_M), outline], axis=1)
    back = front * np.array([0.0, 1.0, 1.0])
    n = len(outline)
    centre = np.array([_THICK_M, 0.0, 0.0])
    corners = np.stack([np.broadcast_to(centre, (n, 3)), front, np.roll(front, -1, axis=0)], axis=1)
    uvs = corners[..., 1:] / size_m + 0.5
    face = Patch(corners, uvs, np.zeros(n, dtype=np.int64))
    rear = Patch(corners * np.array([0.0, 1.0, 1.0]), uvs, np.zeros(n, dtype=np.int64)).flipped()
    rim = grid(np.stack([np.concatenate([ring, ring[:1]]) for ring in (back, front)]))
    return join_patches([face, rear.painted(1), rim.painted(1)])


def _round_corners(corners: Array, radius: float) -> Array:
    """A polygon with its corners cut off by short arcs, [n * 4, 2]."""
    to_last, to_next = (unit(np.roll(corners, shift, axis=0) - corners) for shift in (1, -1))
    # Quadratic curves from one side to the other.
    shares = (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
    curves = [corners + radius * (to_last * (1 - t) ** 2 + to_next * t**2) for t in shares]
    return np.stack(curves, axis=1).reshape(-1, 2)
