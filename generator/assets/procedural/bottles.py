"""Bottles and jars: bodies of revolution with a wrap-around label and a cap."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gen_data.generator.assets.procedural import collision_hulls as hulls
from gen_data.generator.assets.procedural.data_tables import load_table
from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.material_presets import (
    CAPS,
    PALETTES,
    STEEL,
    draw_linear,
    metal_material,
    plastic_material,
    printed_material,
)
from gen_data.generator.assets.procedural.patches import Patch, make_centred_solid
from gen_data.generator.assets.procedural.surface_shapes import Point2, fillet, lathe
from gen_data.generator.assets.procedural.variant_rng import in_turn, variant_rng
from gen_data.generator.core.asset_types import Material

# Width by height of the unrolled label; its texture is drawn at this aspect.
LABEL_ASPECT = 2.6

_WATER_IOR = 1.33
# Label paper stands this much proud of the wall.
_PROUD_M = 0.0003


@dataclass(frozen=True, slots=True)
class BottleStyle:
    """Ranges of the measures of one kind of bottle.

    Attributes:
        shoulder: (radius as a share of the body's beyond the neck's, height as a share of the way
            from label to neck) of the points between body and neck.
        depth: Extent along Y as a share of that along X.
        colors: Of the body; of a clear bottle, the tint of light that has passed through it.
        caps: Of the cap.
        clear: Whether it is transparent and full of water: body and filling refract as one.
    """

    height_m: tuple[float, float]
    radius_m: tuple[float, float]
    neck_m: float
    neck_share: tuple[float, float]
    label_share: tuple[float, float]
    shoulder: tuple[Point2, ...]
    cap_m: tuple[float, float]
    depth: float
    colors: tuple[str, ...]
    caps: tuple[str, ...]
    gloss: tuple[float, float] = (0.06, 0.15)
    clear: bool = False


BOTTLES = load_table(__package__, "bottles", BottleStyle)


def bottle(seed: int) -> Solid:
    """A bottle of one of the styles in ``BOTTLES``. Slots: body, label, cap."""
    rng = variant_rng("bottle", seed)
    style = BOTTLES[in_turn(tuple(BOTTLES), seed)]
    height, radius = rng.between(*style.height_m), rng.between(*style.radius_m)
    neck_z = height * rng.between(*style.neck_share)
    z0, z1 = height * style.label_share[0], min(height * style.label_share[1], neck_z - 0.01)
    shoulder = [
        (style.neck_m + r * (radius - style.neck_m), z1 + t * (neck_z - z1))
        for r, t in style.shoulder
    ]
    cap_radius, cap_height = style.cap_m
    cap_z, neck_top = height - cap_height, height - 0.4 * cap_height
    upper = [*shoulder, (style.neck_m, neck_z), (style.neck_m, neck_top)]
    patches = [
        *_wall_with_label(radius, (z0, z1), upper, [0.06] * (len(upper) - 1)),
        lathe([(style.neck_m, neck_top), (0.0, neck_top)], 32, 0),
        _cap(cap_radius, cap_z, height),
    ]
    stages = [
        (0.93 * radius, 0.0),
        (radius, 0.008),
        (radius, z1),
        *shoulder,
        (max(style.neck_m, 0.96 * cap_radius), neck_z + 0.004),
        (cap_radius, cap_z),
        (0.97 * cap_radius, height),
    ]
    flat = np.array([1.0, style.depth, 1.0])
    parts = [hull * flat for hull in hulls.stack(_drop_level_stages(stages))]
    body = Material(draw_linear(style.colors, 0.1, rng), rng.between(*style.gloss))
    if style.clear:
        body = replace(body, roughness=0.04, transmission=1.0, ior=_WATER_IOR, thin=False)
    label = printed_material(f"texture/label?seed={seed}", rng.between(0.35, 0.6))
    flattened = [patch.scaled(1.0, style.depth, 1.0) for patch in patches]
    return make_centred_solid(flattened, (body, label, plastic_material(rng, style.caps)), parts)


def jar(seed: int) -> Solid:
    """A filled preserving jar with a twist-off lid. Slots: body, label, lid."""
    rng = variant_rng("jar", seed)
    radius, height = rng.between(0.031, 0.043), rng.between(0.085, 0.14)
    top, lid_radius, mouth = height - 0.014, 0.9 * radius, 0.86 * radius
    upper = [(radius, 0.8 * height), (mouth, top - 0.003), (mouth, top + 0.004)]
    patches = [
        *_wall_with_label(radius, (0.2 * height, 0.66 * height), upper, [0.02, 0.006]),
        lathe([(mouth, top + 0.004), (0.0, top + 0.004)], 32, 0),
        _lid(lid_radius, top, height),
    ]
    glass = Material(draw_linear(PALETTES["fillings"], 0.15, rng), rng.between(0.06, 0.12))
    label = printed_material(f"texture/label?seed={seed + 1000}", rng.between(0.45, 0.65))
    lid = rng.choose(
        (
            metal_material((0.83, 0.69, 0.35), 0.3),
            metal_material(STEEL, 0.3),
            plastic_material(rng, CAPS),
        )
    )
    stages = [(0.92 * radius, 0.0), (radius, 0.008), (radius, 0.8 * height), (lid_radius, top),
              (lid_radius, height)]  # fmt: skip
    return make_centred_solid(patches, (glass, label, lid), hulls.stack(stages))


def _wall_with_label(
    radius: float, label: Point2, upper: list[Point2], radii: list[float]
) -> list[Patch]:
    """Bottom and wall up to the last point of ``upper``, with a label between two heights."""
    z0, z1 = label
    lower = fillet(
        [(0.0, 0.004), (0.6 * radius, 0.003), (0.72 * radius, 0.0), (0.93 * radius, 0.0),
         (radius, 0.008), (radius, z0 - _PROUD_M), (radius + _PROUD_M, z0)],
        [0.0, 0.0, 0.0, 0.004, 0.01, 0.0, 0.0],
        3,
    )  # fmt: skip
    rest = [(radius + _PROUD_M, z1), (radius, z1 + _PROUD_M), *upper]
    return [
        lathe(lower, 32, 0),
        lathe([(radius + _PROUD_M, z0), (radius + _PROUD_M, z1)], 32, 1, v=(0.0, 1.0)),
        lathe(fillet(rest, [0.0, 0.0, *radii, 0.0], 3), 32, 0),
    ]


def _cap(radius: float, low: float, high: float) -> Patch:
    """A screw cap, closed below."""
    profile = [(0.0, low), (radius, low), (0.97 * radius, high), (0.0, high)]
    return lathe(fillet(profile, [0.0, 0.0008, 0.002, 0.0], 2), 24, 2)


def _lid(radius: float, low: float, high: float) -> Patch:
    """A twist-off lid with a sunken panel."""
    profile = [(0.0, low), (radius, low), (radius, high), (radius - 0.006, high),
               (radius - 0.008, high - 0.0012), (0.0, high - 0.0012)]  # fmt: skip
    return lathe(fillet(profile, [0.0, 0.001, 0.002, 0.0, 0.0, 0.0], 2), 32, 2)


def _drop_level_stages(stages: list[Point2]) -> list[Point2]:
    """Return the stages that lie above the one before."""
    kept = stages[:1]
    for stage in stages[1:]:
        if stage[1] > kept[-1][1] + 1e-4:
            kept.append(stage)
    return kept
