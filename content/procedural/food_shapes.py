"""Shapes of which dishes and plates of food consist: mounds, slices, leaves, crumbs and smears.

Sizes are in metres. Every shape is closed: it may lie on, or intersect, another one.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np

from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.material_presets import draw_linear
from gen_data.content.procedural.patches import Array, Patch, join_patches, unit
from gen_data.content.procedural.surface_shapes import Point2
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng

_GOLDEN_RAD = math.pi * (3.0 - math.sqrt(5.0))


def food_material(
    kind: str, seed: int, roughness: float, scale_m: float, tint: Vec3 = (1.0, 1.0, 1.0)
) -> Material:
    """A surface of ``food_surfaces.yaml``, projected along the axes."""
    texture = f"texture/food_surface?kind={kind}&seed={seed}"
    return Material(tint, roughness, texture=texture, texture_scale_m=scale_m, printed=True)


def plain_food(codes: Sequence[str], roughness: float, rng: VariantRng) -> Material:
    """A food of one colour, drawn from sRGB codes."""
    return Material(draw_linear(codes, 0.1, rng), roughness, printed=True)


def wobble(count: int, size: float, rng: VariantRng) -> Callable[[Array], Array]:
    """Factor about 1 over angles about Z [rad]: a sum of ``count`` waves."""
    waves = [
        (k, rng.between(0.3, 1.0) / k**0.5, rng.between(0.0, 6.28)) for k in range(2, count + 2)
    ]

    def factor(turn: Array) -> Array:
        total = np.zeros_like(turn)
        for k, strength, phase in waves:
            total += strength * np.cos(k * turn + phase)
        return 1.0 + size * total

    return factor


def mound(
    radius: float, height: float, rng: VariantRng, *, rough: float = 0.06, flat: float = 1.0
) -> Patch:
    """A heap with a flat bottom on z = 0.

    Args:
        radius: Mean radius of its foot.
        height: Height of its middle.
        rng: Draws its outline.
        rough: Depth of its dents as a share of the radius.
        flat: Below 1 it is flatter on top and steeper at the side.
    """
    outline = wobble(5, rough, rng)
    dents = wobble(7, 1.2 * rough, rng)

    def shape(d: Array) -> Array:
        turn = np.arctan2(d[..., 1], d[..., 0])
        r = radius * outline(turn)
        up = np.maximum(d[..., 2], 0.0) ** flat * height
        up = up * (1.0 + (dents(turn + 3.0 * d[..., 2]) - 1.0) * (1.0 - d[..., 2] ** 2))
        return np.stack([r * d[..., 0], r * d[..., 1], up], axis=2)

    return shapes.ball(shape, 14, 28)


def smear(radius: float, rng: VariantRng, *, thick: float = 0.0007, stretch: float = 1.0) -> Patch:
    """A flat, ragged blot on z = 0, drawn out along X."""
    outline = wobble(9, 0.16, rng)

    def shape(d: Array) -> Array:
        turn = np.arctan2(d[..., 1], d[..., 0])
        r = radius * outline(turn)
        up = thick * np.maximum(d[..., 2], 0.0) ** 0.5
        return np.stack([stretch * r * d[..., 0], r * d[..., 1], up], axis=2)

    return shapes.ball(shape, 6, 36)


def puck(radius: float, height: float, rng: VariantRng, *, soft: float = 0.3) -> Patch:
    """A round slice on z = 0: of tomato, sausage, egg, cucumber, a pancake."""
    outline = wobble(4, 0.03, rng)
    edge = min(soft * radius, 0.49 * height)
    profile = shapes.fillet(
        [(0.0, 0.0), (radius, 0.0), (radius, height), (0.0, height)], [0.0, edge, edge, 0.0], 2
    )
    flat = shapes.lathe(profile, 20)
    corners = flat.corners_m.copy()
    factor = outline(np.arctan2(corners[..., 1], corners[..., 0]))
    corners[..., :2] *= factor[..., None]
    return Patch(corners, flat.uvs, flat.slots)


def sector(profile: Sequence[Point2], turn_rad: float, steps: int, slots: Point2) -> Patch:
    """A piece of a body of revolution about Z, from angle 0 to ``turn_rad``, with cut faces.

    Args:
        profile: Outline of (radius, z), counter-clockwise in that plane, from the axis to the axis.
        turn_rad: Less than a whole turn.
        steps: Quads along the arc.
        slots: Slots of the outside and of the cut faces.
    """
    outline = np.array(profile)
    turn = np.linspace(0.0, turn_rad, steps + 1)
    around = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    xy = outline[:, None, :1] * around[None]
    z = np.broadcast_to(outline[:, None, 1:], (*xy.shape[:2], 1))
    outside = shapes.grid(np.concatenate([xy, z], axis=2), slot=int(slots[0]))
    flat = shapes.triangulate(outline)
    low, size = outline.min(axis=0), np.ptp(outline, axis=0)
    cuts = []
    for angle, is_start in ((0.0, True), (turn_rad, False)):
        r, z = flat[..., 0], flat[..., 1]
        corners = np.stack([r * math.cos(angle), r * math.sin(angle), z], axis=2)
        cut = Patch(corners, (flat - low) / size, np.full(len(flat), int(slots[1]), np.int64))
        # The plane (radius, z) has its normal against the turn.
        cuts.append(cut if is_start else cut.flipped())
    return join_patches([outside, *cuts])


def sheet(
    outline: Callable[[Array], Array], thick: float, waves: int, depth: float, rng: VariantRng
) -> Patch:
    """A thin leaf or slice that ripples toward its edge: lettuce, ham, cheese that has melted.

    Args:
        outline: Factor [m] on the unit circle by angle about Z.
        thick: Thickness.
        waves: Ripples around the edge.
        depth: Height of the ripples at the edge.
        rng: Draws their phases.
    """
    phase, other = rng.between(0.0, 6.28), rng.between(0.0, 6.28)

    def shape(d: Array) -> Array:
        turn = np.arctan2(d[..., 1], d[..., 0])
        away = np.sqrt(np.maximum(1.0 - d[..., 2] ** 2, 0.0))
        r = outline(turn)
        lift = (
            depth
            * away**3
            * (np.sin(waves * turn + phase) + 0.5 * np.sin(2.3 * waves * away + other))
        )
        return np.stack([r * d[..., 0], r * d[..., 1], 0.5 * thick * d[..., 2] + lift], axis=2)

    return shapes.ball(shape, 7, 5 * waves)


def spread(count: int, radius: float, rng: VariantRng) -> Array:
    """Places in a disc, shape [count, 2], even with some disorder."""
    i = np.arange(count) + rng.between(0.2, 1.0)
    turn = _GOLDEN_RAD * i + rng.between(0.0, 6.28) + 0.5 * (rng.random(count) - 0.5)
    r = radius * np.sqrt(i / (count + 0.5)) * (0.85 + 0.15 * rng.random(count))
    return np.stack([r * np.cos(turn), r * np.sin(turn)], axis=1)


def crumbs(count: int, radius: float, size: float, rng: VariantRng) -> Patch:
    """Crumbs strewn in a disc on z = 0, most of them small."""
    piece = shapes.ball(lambda d: d * np.array([1.0, 0.8, 0.7]), 4, 5)
    made = []
    for x, y in spread(count, radius, rng):
        r = size * (0.25 + 0.75 * rng.between(0.0, 1.0) ** 3)
        turned = piece.rotated("x", rng.between(0.0, 3.0)).rotated("z", rng.between(0.0, 6.28))
        made.append(turned.scaled(r, r, r).moved(float(x), float(y), 0.6 * r))
    return join_patches(made)


def wrap(points: Array, count: int = 40) -> Array:
    """At most 46 points of a cloud: a small hull with the cloud's own bounds."""
    flat = points.reshape(-1, 3)
    ends = [*flat.argmin(axis=0).tolist(), *flat.argmax(axis=0).tolist()]
    hull = np.concatenate([hulls.extreme(flat, count), flat[ends]])
    return np.array(np.unique(np.round(hull, 9), axis=0))


def turned(patch: Patch, axis: Array, angle_rad: float) -> Patch:
    """The patch turned about any axis through the origin (Rodrigues)."""
    x, y, z = unit(np.asarray(axis, dtype=np.float64)[None])[0]
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    spin = np.eye(3) + math.sin(angle_rad) * k + (1.0 - math.cos(angle_rad)) * (k @ k)
    moved = np.einsum("ij,ntj->nti", spin, patch.corners_m, optimize=False)
    return Patch(moved, patch.uvs, patch.slots)
