"""Dirt on vehicles: along sills, around and behind wheels, low in front, on the rear.

Wheels throw up dirt from the road, and the recirculating wake carries it onto the rear (Gaylard,
Kirwan and Lockerby, "Surface contamination of cars: a review", Proc. IMechE Part D 231(9), 2017).
Widths and shares of the deposits are assumed, within a half.

Materials multiply their texture, and dust is paler than dark paint: the texture has the paint's
colour, and the material is white. Texture coordinates depend on the place alone: u runs from the
middle of the front over the side to the middle of the rear, on both sides; v from the ground up.
"""

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from gen_data.assets.family import Solid
from gen_data.content.procedural import wear as traces
from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.content.procedural.patches import Array
from gen_data.content.procedural.place_coordinates import map_by_place
from gen_data.core.asset_types import Float32, Material, TextureData, UInt8
from gen_data.core.colorimetry import srgb_encode
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import variant_rng

DUST: Vec3 = (0.17, 0.145, 0.115)
"""Dry road dust, linear RGB."""
FAMILY = "texture/road_dirt"
SEEDS = 4
AXLES = (0.62, -0.6)
"""Where the axles are along the image's side: 1 = front end, -1 = rear end of the vehicle."""
_SIZE_PX = (64, 256)
# Border of the image: coarse mip levels must not mix its opposite sides.
_MARGIN = 0.07
# Largest ratio of the roughness of clean paint to the roughness of dirt.
_CLEAN = 0.5
_BRAKE_DUST: Vec3 = (0.035, 0.026, 0.02)
_WHITE: Vec3 = (1.0, 1.0, 1.0)


class Frame(NamedTuple):
    """Dimensions to which the coordinates of dirt refer [m].

    Attributes:
        bounds_m: Bounds of the body, without mirrors: smallest and largest coordinates.
        front_m, rear_m: X of the axles.
    """

    bounds_m: tuple[Vec3, Vec3]
    front_m: float
    rear_m: float


def soil(solid: Solid, name: str, seed: int) -> Solid:
    """A vehicle with the dirt of its variant's age on paint and plastic, brake dust on its rims."""
    amount = traces.draw_wear(name, seed)
    materials = tuple(_soil_slot(m, amount, seed) for m in solid.mesh.materials)
    dirty = [k for k, m in enumerate(materials) if is_soiled(m)]
    mesh = replace(solid.mesh, materials=materials)
    frame = Frame(solid.body_bounds_m or mesh.bounds_m(), *axles_m(solid))
    return replace(
        solid, mesh=map_by_place(mesh, dirty, lambda points_m: dirt_coordinates(points_m, frame))
    )


def _soil_slot(material: Material, amount: float, seed: int) -> Material:
    if material.role == "rim":
        # Pads shed onto the rim from the first day.
        share = 0.1 + 0.45 * amount
        color = _mix(material.base_color, _BRAKE_DUST, share)
        rough = material.roughness + (0.7 - material.roughness) * share
        return replace(material, base_color=color, roughness=round(rough, 4))
    gathers = material.role == "paint" or (material.role == "trim" and material.roughness > 0.45)
    return soiled(material, amount, seed) if gathers and not material.texture else material


def soiled(material: Material, amount: float, seed: int) -> Material:
    """A plain material under dirt of an amount in [0, 1], in tenths; see ``cleaned``."""
    paint = "".join(f"{c:02x}" for c in _encode(np.array(material.base_color)).tolist())
    texture = f"{FAMILY}?amount={round(min(amount, 1.0), 1)}&paint=rgb{paint}&seed={seed % SEEDS}"
    rough = round(min(1.0, material.roughness / _CLEAN), 4)
    return replace(material, base_color=_WHITE, roughness=rough, texture=texture)


def is_soiled(material: Material) -> bool:
    """Whether it is the result of ``soiled``."""
    return material.texture.startswith(FAMILY + "?")


def cleaned(material: Material) -> tuple[Material, int]:
    """The plain material under the dirt, and the dirt's seed."""
    fields = dict(field.split("=") for field in material.texture.partition("?")[2].split("&"))
    rough = round(material.roughness * _CLEAN, 4)
    color = _decode(fields["paint"])
    return replace(material, base_color=color, roughness=rough, texture=""), int(fields["seed"])


def axles_m(solid: Solid) -> tuple[float, float]:
    """Places of the front and the rear axle along X, by keypoints, else a fifth from the ends."""
    places = {point.name: point.position_m[0] for point in solid.keypoints}
    (low, _, _), (high, _, _) = solid.mesh.bounds_m()
    fifth = 0.2 * (high - low)
    return places.get("wheel_front_left", high - fifth), places.get("wheel_rear_left", low + fifth)


def dirt_coordinates(points_m: Float32, frame: Frame) -> Float32:
    """Texture coordinates of points [n, 3] of a vehicle, shape [n, 2]; linear between the axles."""
    (x0, y0, _), (x1, y1, z1) = frame.bounds_m
    x, y, z = points_m.astype(np.float64).T
    along = np.interp(x, [x0, frame.rear_m, frame.front_m, x1], [-1.0, AXLES[1], AXLES[0], 1.0])
    inward = 1.0 - np.minimum(np.abs(y) / max(-y0, y1), 1.0)
    u = 0.5 - 0.25 * along * (1.0 + inward)
    v = np.clip(z / z1, 0.0, 1.0)
    inside = _MARGIN + (1.0 - 2.0 * _MARGIN) * np.stack([u, v], axis=1)
    return inside.astype(np.float32)


def road_dirt(seed: int, amount: float, paint: str) -> TextureData:
    """Paint under dirt, 256 x 64.

    Args:
        seed: Seed of the pattern.
        amount: 0 clean to 1 a winter without a wash.
        paint: Colour of the paint below, sRGB: ``rgb`` and six hexadecimal digits.
    """
    share = amount * dirt_share(seed % SEEDS)
    steps = np.arange(256) / 255.0
    below, dust = np.array(_decode(paint)), np.array(DUST)
    colors = _encode(below + steps[:, None] * (dust - below))
    index = traces.to_bytes(share)
    factor = np.round(255.0 * (_CLEAN + (1.0 - _CLEAN) * np.minimum(1.6 * steps, 1.0)))
    return TextureData(colors.take(index, axis=0), factor.astype(np.uint8).take(index))


@lru_cache(maxsize=SEEDS)
def dirt_share(seed: int) -> Float32:
    """Share of the surface that dirt covers on a vehicle that was not washed, [64, 256]."""
    rng = variant_rng("road_dirt", seed)
    rows, columns = _SIZE_PX
    u, below = (
        np.clip(((np.arange(n) + 0.5) / n - _MARGIN) / (1.0 - 2.0 * _MARGIN), 0.0, 1.0)
        for n in (columns, rows)
    )
    u, v = u[None, :], 1.0 - below[:, None]
    along = np.clip((0.5 - u) * 4.0, -1.0, 1.0)
    side = _ramp(u, 0.19, 0.26) * _ramp(u, 0.81, 0.74)
    sill = 0.75 * np.exp(-np.maximum(v - 0.14, 0.0) / 0.11)
    thrown = sum((_spray(along, v, axle) for axle in AXLES), np.zeros(_SIZE_PX))
    # The wake covers all of the rear, most below the window.
    wake = _ramp(u, 0.74, 0.82) * (0.22 + 0.5 * _ramp(v, 0.75, 0.3))
    nose = _ramp(u, 0.26, 0.2) * 0.4 * np.exp(-np.maximum(v - 0.12, 0.0) / 0.12)
    total = side * np.maximum(sill, thrown) + wake + nose + 0.05
    clouds = traces.noise_bytes(traces.MEDIUM, _SIZE_PX, rng) / 255.0
    specks = traces.noise_bytes(traces.FINE, _SIZE_PX, rng) / 255.0
    uneven = total * (0.05 + 0.9 * clouds + 1.0 * specks)
    return np.clip(uneven, 0.0, 0.9).astype(np.float32)


def _spray(along: Array, v: Array, axle: float) -> Array:
    """Share from one wheel: dirt that clings around the arch, and the plume behind it."""
    # The side's coordinates are about 2.2 m and 1.5 m long.
    x_m, z_m = 2.2 * (along - axle), 1.5 * v - 0.31
    arch = 0.5 * np.exp(-np.maximum(np.sqrt(x_m**2 + z_m**2) - 0.33, 0.0) / 0.09)
    behind = np.maximum(-x_m - 0.3, 0.0)
    plume = (x_m < -0.3) * np.exp(-behind / 0.5) * np.exp(-np.maximum(z_m - 0.1, 0.0) / 0.25)
    share: Array = np.maximum(arch, 0.8 * plume * np.minimum(behind / 0.05, 1.0))
    return share


def _encode(linear: Array) -> UInt8:
    """Linear colours as 8-bit sRGB."""
    encoded: UInt8 = np.round(255.0 * srgb_encode(linear)).astype(np.uint8)
    return encoded


def _decode(paint: str) -> Vec3:
    """Linear RGB of ``rgb`` and six hexadecimal digits."""
    return hex_to_linear("#" + paint.removeprefix("rgb"))


def _ramp(values: Array, low: float, high: float) -> Array:
    """0 at ``low``, 1 at ``high``, linear between."""
    share: Array = np.clip((values - low) / (high - low), 0.0, 1.0)
    return share


def _mix(first: Vec3, second: Vec3, share: float) -> Vec3:
    r, g, b = (round(x + (y - x) * share, 6) for x, y in zip(first, second, strict=True))
    return (r, g, b)
