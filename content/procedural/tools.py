"""Hand tools, lying on a table along X with the handle at -X."""

import math
from dataclasses import dataclass

import numpy as np

from gen_data.assets.family import Solid, axis_symmetries
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import material_presets as presets
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.patches import (
    Array,
    Patch,
    join_patches,
    make_centred_solid,
    rotate,
)
from gen_data.core.asset_types import Material, Symmetry
from gen_data.core.variant_rng import VariantRng, variant_rng

_LAID = 0.5 * math.pi


def screwdriver(rng: VariantRng) -> Solid:
    """A screwdriver with a fluted handle, slotted or pointed tip. Slots: handle, steel, ring."""
    shape = _draw_screwdriver(rng)
    radius, grip, blade, shaft = shape.radius_m, shape.grip_m, shape.blade_m, shape.shaft_m
    handle = _fluted_handle(radius, grip, shape.flutes)
    end = grip + blade
    pieces = [
        handle,
        shapes.cone((shaft, grip - 0.01), (shaft, end - 0.012), 16, 1),
        shapes.cone((0.45 * radius, grip - 0.001), (0.42 * radius, grip + 0.004), 20, 2),
        _flat_tip(shaft, end) if shape.flat else _pointed_tip(shaft, end),
    ]
    profile = [(0.55 * radius, 0.0), (0.97 * radius, 0.1 * grip), (0.97 * radius, 0.6 * grip),
               (0.7 * radius, 0.82 * grip), (0.6 * radius, grip)]  # fmt: skip
    parts = [*hulls.stack(profile, 16), hulls.frustum((shaft, grip), (shaft, end), 12)]
    plastic = presets.plastic_material(rng)
    steel = presets.metal_material(presets.ZINC, rng.between(0.2, 0.35))
    materials = (plastic, steel, presets.plastic_material(rng, ("#202124",)))
    laid = [piece.rotated("y", _LAID) for piece in pieces]
    return make_centred_solid(laid, materials, [rotate(part, "y", _LAID) for part in parts])


def screwdriver_symmetries(seed: int) -> tuple[Symmetry, ...]:
    """Half a turn of a flat blade, else the turns of the flutes; any turn without flutes."""
    shape = _draw_screwdriver(variant_rng("screwdriver", seed))
    return axis_symmetries(x=2 if shape.flat else shape.flutes)


@dataclass(frozen=True, slots=True)
class _Screwdriver:
    """Measures of a screwdriver [m], number of its flutes, and whether its tip is flat."""

    radius_m: float
    grip_m: float
    blade_m: float
    shaft_m: float
    flutes: int
    flat: bool


def _draw_screwdriver(rng: VariantRng) -> _Screwdriver:
    radius, grip = rng.between(0.011, 0.016, "radius_m"), rng.between(0.085, 0.115, "grip_m")
    blade, shaft = rng.between(0.06, 0.15, "blade_m"), rng.between(0.0025, 0.0038, "shaft_m")
    return _Screwdriver(
        radius,
        grip,
        blade,
        shaft,
        flutes=rng.choose((0, 6, 6, 8), "flutes"),
        flat=rng.chance(0.5, "flat"),
    )


def hammer(rng: VariantRng) -> Solid:
    """A joiner's hammer with wooden or plastic handle. Slots: handle, head."""
    length, size = rng.between(0.26, 0.33, "length_m"), rng.between(0.9, 1.1, "size_scale")
    handle = _hammer_handle(length)
    head, head_hulls = _hammer_head()
    wood = Material(presets.draw_linear(presets.WOODS[:4], 0.1, rng), 0.55)
    grip = wood if rng.chance(0.6) else presets.plastic_material(rng, presets.PLASTICS)
    steel = presets.metal_material(*rng.choose(presets.METALS["hammers"]))
    at = length - 0.005
    share = handle.corners_m[:, :, 0].mean(axis=1) / length
    parts = [hulls.extreme(handle.corners_m[abs(share - m) < 0.2], 40) for m in (0.18, 0.5, 0.8)]
    parts += [hull * size + np.array([at, 0.0, 0.0]) for hull in head_hulls]
    head = head.scaled(size, size, size).moved(at)
    return make_centred_solid([handle, head], (grip, steel), parts)


def wrench(rng: VariantRng) -> Solid:
    """A combination wrench: open jaw at +X, ring at -X. Slot: steel."""
    across = rng.choose((0.010, 0.012, 0.013, 0.015, 0.017, 0.019), "across_flats_m")
    length = across * rng.between(10.5, 12.5)
    thick, bar = 0.33 * across + 0.0012, 0.36 * across + 0.0015
    head, ring = 1.12 * across, 0.8 * across
    centre = np.array([length - head, 0.0])
    shank = np.array(
        [(0.6 * ring, -bar), (length - 1.75 * head, -0.85 * bar),
         (length - 1.75 * head, 0.85 * bar), (0.6 * ring, bar)]
    )  # fmt: skip
    bevel = 0.12 * thick
    outline = shapes.circle(ring, 32)
    eye = shapes.extrude(outline, 1.3 * thick, bevel, [shapes.circle(0.57 * across, 24)])
    patches = [
        shapes.extrude(_turn_jaw(_jaw(across, head)) + centre, thick, bevel).moved(z=-0.5 * thick),
        shapes.extrude(shank, 0.8 * thick, 0.3 * thick).moved(z=-0.4 * thick),
        eye.moved(z=-0.65 * thick),
    ]
    finish = presets.metal_material(*rng.choose(presets.METALS["wrenches"]))
    h = 0.5 * thick
    parts = [
        *(_slab(_turn_jaw(piece) + centre, h) for piece in _jaw_pieces(across, head)),
        _slab(shank, 0.8 * h),
        *hulls.ring((0.57 * across, ring, -1.3 * h), (0.57 * across, ring, 1.3 * h), 8),
    ]
    return make_centred_solid(patches, (finish,), parts)


def _jaw(across: float, radius: float) -> Array:
    """Outline of an open jaw about the origin: a disc with a slot towards +X."""
    start, back = math.asin(0.5 * across / radius), -0.35 * across
    arc = _arc(radius, start, 2 * math.pi - start, 26)
    return np.concatenate([arc, [(back, -0.5 * across), (back, 0.5 * across)]])


def _jaw_pieces(across: float, radius: float) -> list[Array]:
    """The same jaw as convex outlines: two prongs and the palm behind the slot."""
    start = math.asin(0.5 * across / radius)
    prong = _arc(radius, start, math.pi - start, 12)
    open_ = math.acos(-0.35 * across / radius)
    return [prong, prong * np.array([1.0, -1.0]), _arc(radius, open_, 2 * math.pi - open_, 12)]


def _arc(radius: float, start_rad: float, end_rad: float, count: int) -> Array:
    """Points of an arc about the origin, shape [count, 2]."""
    turn = np.linspace(start_rad, end_rad, count)
    points: Array = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return points


def _turn_jaw(points: Array) -> Array:
    """Points [n, 2] turned by the 15 degrees of a wrench's jaw."""
    return rotate(np.insert(points, 2, 0.0, axis=1), "z", math.radians(15.0))[:, :2]


def _slab(outline: Array, half: float) -> Array:
    """An outline between z = -half and half."""
    return np.concatenate([np.insert(outline, 2, z, axis=1) for z in (-half, half)])


def _fluted_handle(radius: float, length: float, flutes: int) -> Patch:
    """A screwdriver's handle along Z: a bulb with a waist, grooved over most of its length."""
    t = np.linspace(0.0, 1.0, 22)
    at = (0.0, 0.03, 0.1, 0.3, 0.6, 0.78, 0.88, 0.95, 1.0)
    girth = np.interp(t, at, (0.55, 0.8, 0.97, 1.0, 0.95, 0.72, 0.66, 0.72, 0.5))
    turn = 2 * math.pi * np.arange(32) / 32
    depth = np.where((t > 0.08) & (t < 0.72), 0.09, 0.0)[:, None] * (flutes > 0)
    r = radius * girth[:, None] * (1 - depth * np.maximum(np.cos(flutes * turn), 0.0) ** 2)
    z = np.broadcast_to(length * t[:, None], r.shape)
    rows = np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=2)
    rows = np.concatenate([rows, rows[:, :1]], axis=1)
    return join_patches([shapes.grid(rows), shapes.fan(rows[0, :0:-1]), shapes.fan(rows[-1, :-1])])


def _pointed_tip(radius: float, end: float) -> Patch:
    """A cross-head tip, as the cone it is ground from."""
    profile = [(0.0, end - 0.013), (radius, end - 0.013), (radius, end - 0.008),
               (0.3 * radius, end), (0.0, end)]  # fmt: skip
    return shapes.lathe(profile, 8, 1)


def _hammer_handle(length: float) -> Patch:
    """An oval shaft along X that swells in the hand."""
    at = (0.0, 0.02, 0.1, 0.25, 0.5, 0.75, 0.97)
    t = np.linspace(0.0, 0.97, 18)
    wide = np.interp(t, at, (0.9, 1.05, 0.95, 1.05, 0.8, 0.72, 0.75))
    deep = np.interp(t, at, (1.0, 1.1, 1.05, 1.1, 0.95, 0.9, 0.9))
    path = np.stack([length * t, 0 * t, 0 * t], axis=1)
    oval = shapes.circle(1.0, 18) * np.array([0.011, 0.016])
    return shapes.sweep(path, oval, scale=np.stack([wide, deep], axis=1))


def _hammer_head() -> tuple[Patch, list[Array]]:
    """Eye at the origin, striking face towards +Y, wedge towards -Y; slot 1."""
    eye = shapes.rounded_box((0.03, 0.036, 0.026), 0.003, 1)
    profile = [(0.0, 0.015), (0.009, 0.015), (0.009, 0.034), (0.0138, 0.04), (0.0138, 0.058),
               (0.0, 0.0585)]  # fmt: skip
    face = shapes.lathe(shapes.fillet(profile, [0.0, 0.0, 0.004, 0.003, 0.0015, 0.0], 2), 24)
    peen = _peen()
    parts = [
        hulls.box((-0.015, -0.018, -0.013), (0.015, 0.018, 0.013)),
        rotate(hulls.frustum((0.0138, 0.015), (0.0138, 0.058), 16), "x", -_LAID),
        hulls.extreme(peen.corners_m, 24),
    ]
    return join_patches([eye, face.rotated("x", -_LAID), peen]).painted(1), parts


def _flat_tip(radius: float, end: float) -> Patch:
    """Blade of a slotted screwdriver along Z: from round to a wide thin edge."""
    stations = [(-0.014, 1.0, 1.0), (-0.01, 1.35, 0.62), (-0.004, 1.25, 0.3), (0.0, 1.2, 0.16)]
    z, wide, thin = (np.array([s[i] for s in stations]) for i in range(3))
    path, scale = np.stack([0 * z, 0 * z, end + z], axis=1), np.stack([wide, thin], axis=1)
    return shapes.sweep(path, shapes.circle(radius, 12), up=(1.0, 0.0, 0.0), scale=scale, slot=1)


def _peen() -> Patch:
    """The wedge at the back of a hammer's head, towards -Y."""
    stations = [(0.015, 0.013, 0.011), (0.03, 0.012, 0.009), (0.056, 0.0115, 0.0022),
                (0.059, 0.0105, 0.0012)]  # fmt: skip
    corners = ((1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1))
    loops = np.array([[(a * w, -y, b * thin) for a, b in corners] for y, w, thin in stations])
    parts = [shapes.grid(loops), shapes.fan(loops[0, :0:-1]), shapes.fan(loops[-1, :-1])]
    return join_patches(parts)
