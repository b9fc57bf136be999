"""Street furniture. Sizes after manufacturers' catalogues and the standards named below.

Everything stands on the origin; fronts face +X.
"""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from gen_data.assets.family import Facts, Solid, axis_symmetries
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import (
    metal_material,
    painted_material,
    patterned_material,
    printed_material,
)
from gen_data.content.procedural.patches import Patch, join_patches
from gen_data.content.procedural.surface_shapes import block, cone, lathe, rounded_box
from gen_data.content.scenery.basic_shapes import facing_rectangle, make_solid, post, tube
from gen_data.core import asset_types, se3
from gen_data.core.variant_rng import VariantRng, variant_rng

GALVANISED = metal_material((0.42, 0.43, 0.44), 0.55)
_ANTHRACITE = painted_material("#3b3d3f", 0.5)
_IRON_PAINTS = ("#2f3234", "#3b3d3f", "#2f4236", "#55585a")


def street_light(rng: VariantRng) -> Solid:
    """A lamp on a mast of 6-8 m. Slots: mast, lamp. Keypoint ``lamp``."""
    height, reach = rng.between(6.0, 8.0, "height_m"), rng.between(0.8, 1.8, "reach_m")
    foot = [(0.0, 0.0), (0.085, 0.0), (0.085, 1.1), (0.06, 1.16)]
    mast = lathe([*foot, (0.038, height), (0.0, height)], 12)
    rise = rng.choose((0.12, 0.12, 0.5, None))
    head, lens, at = _arm_head(height, reach, rise) if rise else _post_top(height)
    finish = GALVANISED if rng.chance(0.5) else painted_material(rng.choose(_IRON_PAINTS), 0.5)
    glass = asset_types.Material((0.75, 0.76, 0.74), roughness=0.2, role="lamp")
    hull = hulls.frustum((0.085, 0.0), (0.04, height), 12)
    keypoints = (asset_types.Keypoint("lamp", at, 0.1),)
    return make_solid([mast, head, lens.painted(1)], (finish, glass), [hull], keypoints)


def litter_bin(rng: VariantRng) -> Solid:
    """A litter bin on a post, or standing. Slots: body, post."""
    color = rng.choose(("#3a5a40", "#d9702b", "#44484a", "#2f3234", "#6b7073"))
    materials = (painted_material(color, 0.45), GALVANISED)
    if rng.chance(0.5):
        r, h = rng.between(0.16, 0.21, "radius_m"), rng.between(0.45, 0.55, "height_m")
        z = 0.95 - h + 0.15
        shell = [(0.0, z), (0.85 * r, z), (r, z + h), (0.9 * r, z + h), (0.9 * r, z + h - 0.08)]
        body = lathe([*shell, (0.0, z + h - 0.08)], 18).moved(r + 0.04)
        mast = post(0.03, (0.0, 1.2), sides=8)
        bracket = block((-0.02, -0.02, z + 0.1), (0.08 + 0.1 * r, 0.02, z + 0.14))
        parts = [body, mast.painted(1), bracket.painted(1)]
        hull = hulls.frustum((r, z), (r, z + h), 12) + np.array([r + 0.04, 0.0, 0.0])
        return make_solid(parts, materials, [hull])
    r, h = rng.between(0.22, 0.3, "radius_m"), rng.between(0.75, 0.95, "height_m")
    profile = [(0.0, 0.0), (0.9 * r, 0.0), (r, 0.06), (r, h), (0.9 * r, h), (0.88 * r, h - 0.12)]
    body = lathe([*profile, (0.0, h - 0.12)], 20)
    hood = lathe([(0.0, h + 0.16), (r, h + 0.16), (r, h + 0.19), (0.0, h + 0.26)], 20)
    stays = [post(0.012, (h - 0.02, h + 0.17), (0.93 * r * x, 0.93 * r * y, 0.0), 5)
             for x, y in ((1, 0), (-0.5, 0.866), (-0.5, -0.866))]  # fmt: skip
    parts = [body, hood, *(stay.painted(1) for stay in stays)]
    return make_solid(parts, materials, [hulls.frustum((r, 0.0), (r, h), 12)])


def bench(rng: VariantRng) -> Solid:
    """A park bench, sat on from +X. Slots: slats, frame."""
    half, seat = 0.5 * rng.between(1.5, 2.0, "length_m"), rng.between(0.42, 0.46, "seat_m")
    slats = [(-0.18 + 0.115 * k, seat - 0.03, 0.09, 0.03) for k in range(4)]
    if rng.chance(0.75):
        slats += [(-0.24 - 0.03 * k, seat + 0.14 + 0.12 * k, 0.03, 0.09) for k in range(3)]
    parts = [block((x, -half, z), (x + w, half, z + h), 0.008) for x, z, w, h in slats]
    for y in (-half + 0.2, half - 0.2):
        bars = ((-0.2, 0.0, -0.14), (0.18, 0.0, 0.24), (-0.2, seat - 0.09, 0.24))
        legs = [block((a, y - 0.03, z), (b, y + 0.03, seat - 0.03)) for a, z, b in bars]
        rest = [(-0.19, y, seat - 0.05), (-0.27, y, seat + 0.2), (-0.31, y, seat + 0.48)]
        parts += [leg.painted(1) for leg in (*legs, tube(rest, 0.022, 6))]
    grain = f"texture/wood_grain?seed={rng.choose((2, 5))}"
    wood = patterned_material(grain, 1.2, 0.7, (0.75, 0.72, 0.7))
    hull = hulls.box((-0.34, -half, 0.0), (0.27, half, seat))
    return make_solid(parts, (wood, painted_material(rng.choose(_IRON_PAINTS), 0.5)), [hull])


def hydrant(rng: VariantRng) -> Solid:
    """A pillar hydrant with two outlets (EN 14384). Slots: body, caps."""
    h = rng.between(0.75, 0.95, "height_m")
    foot = [(0.0, 0.0), (0.16, 0.0), (0.16, 0.04), (0.105, 0.06)]
    shares = ((0.1, 0.62), (0.135, 0.65), (0.135, 0.72), (0.11, 0.74), (0.1, 0.9), (0.05, 0.97))
    body = lathe([*foot, *((r, z * h) for r, z in shares), (0.0, 0.97 * h)], 18)
    flange = [(0.045, 0.1), (0.06, 0.1), (0.06, 0.16), (0.0, 0.16)]
    outlet = lathe([(0.0, 0.0), (0.045, 0.0), *flange], 12)
    outlets = [
        outlet.rotated("x", turn).moved(0.0, y, 0.8 * h)
        for turn, y in ((-0.5 * math.pi, 0.06), (0.5 * math.pi, -0.06))
    ]
    front = outlet.scaled(1.3, 1.3, 1.0).rotated("y", 0.5 * math.pi).moved(0.06, 0.0, 0.5 * h)
    cap = cone((0.03, 0.96 * h), (0.03, h), 6)
    paint = rng.choose(("#b3201b", "#b3201b", "#c9a227", "#2c5c94"))
    caps = rng.choose(("#b3201b", "#c8cacb", "#d0cfc8"))
    parts = [body, *(o.painted(1) for o in (front, cap, *outlets))]
    hull = hulls.frustum((0.15, 0.0), (0.12, h), 12)
    return make_solid(parts, (painted_material(paint, 0.4), painted_material(caps, 0.4)), [hull])


def bollard(rng: VariantRng) -> Solid:
    """A bollard: iron with a cap, steel with a reflecting band, or stone. Slots: body, band."""
    h, kind = rng.between(0.8, 1.0, "height_m"), _bollard_kind(rng.seed)
    if kind == "stone":
        r = rng.between(0.13, 0.18, "radius_m")
        shares = ((0.0, 0.0), (1.0, 0.0), (0.92, 0.7), (0.6, 0.82), (0.0, 0.86))
        body = lathe([(x * r, z * h) for x, z in shares], 18)
        stone = patterned_material("texture/concrete?seed=3", 1.5, 0.9, (0.9, 0.88, 0.85))
        return make_solid([body], (stone,), [hulls.frustum((r, 0.0), (0.9 * r, 0.8 * h), 12)])
    r = rng.between(0.035, 0.055, "radius_m")
    if kind == "iron":
        r = 1.4 * r
        foot = [(0.0, 0.0), (1.5 * r, 0.0), (1.5 * r, 0.12), (r, 0.16)]
        upper = ((0.85, 0.85), (1.1, 0.87), (1.1, 0.9), (0.6, 0.91), (0.95, 0.96), (0.0, 1.0))
        parts = [lathe([*foot, *((x * r, z * h) for x, z in upper)], 16)]
    else:
        rings = ((0.001, 0.72), (0.003, 0.73), (0.003, 0.84), (0.001, 0.85))
        band = lathe([(r + out, z * h) for out, z in rings], 14).painted(1)
        pole = [(0.0, 0.0), (r, 0.0), (r, h - 0.01), (0.8 * r, h), (0.0, h)]
        parts = [lathe(pole, 14), band]
    paint = painted_material(rng.choose((*_IRON_PAINTS, "#7b7f82")), 0.45)
    stripe = painted_material(rng.choose(("#b3201b", "#e8e7e2")), 0.35)
    return make_solid(parts, (paint, stripe), [hulls.frustum((1.2 * r, 0.0), (r, h), 12)])


def bollard_facts(seed: int) -> Facts:
    """Its kind."""
    return Facts(_bollard_kind(seed))


def bollard_symmetries(seed: int) -> tuple[asset_types.Symmetry, ...]:
    """Any turn about its axis; none for patterned stone."""
    return () if _bollard_kind(seed) == "stone" else axis_symmetries(z=0)


def guide_post(seed: int) -> Solid:
    """A guide post of a road in the country (StVO, sign 620): white, with a black band.

    Traffic on this side of the road, ahead of +X, sees one reflector, traffic on the other side
    two. Height and section are assumed within 0.05 m. Slots: white, band, reflector.
    """
    rng = variant_rng("guide_post", seed)
    h = rng.between(0.95, 1.05, "height_m")
    body = block((-0.03, -0.06, 0.0), (0.03, 0.06, h), 0.008)
    band = block((-0.031, -0.061, h - 0.3), (0.031, 0.061, h - 0.05), 0.0, 1)
    front = block((0.031, -0.02, h - 0.27), (0.034, 0.02, h - 0.09), 0.0, 2)
    behind = [
        block((-0.034, -0.03, z - 0.03), (-0.031, 0.03, z + 0.03), 0.0, 2)
        for z in (h - 0.23, h - 0.13)
    ]
    white, black = painted_material("#e4e4de", 0.55), painted_material("#17181a", 0.5)
    reflector = replace(painted_material("#dfe2e2", 0.2), role="sign")
    hull = hulls.box((-0.034, -0.061, 0.0), (0.034, 0.061, h))
    return make_solid([body, band, front, *behind], (white, black, reflector), [hull])


def traffic_cone(seed: int) -> Solid:
    """A traffic cone with two white sleeves (EN 13422). Slots: orange, white, foot."""
    rng = variant_rng("cone", seed)
    h = rng.choose((0.5, 0.75, 0.75), "height_m")
    half = 0.27 * h + 0.06
    profile = [
        (0.235 * h * (1 - t) + 0.045 * h * t, 0.04 + t * (h - 0.04))
        for t in (0.0, 0.28, 0.48, 0.62, 0.82, 1.0)
    ]
    pieces = [lathe(profile[k : k + 2], 20, slot=k % 2) for k in range(5)]
    (r, top), sunk = profile[-1], h - 0.05
    tip = lathe([(r, top), (0.6 * r, h), (0.5 * r, sunk), (0.0, sunk)], 20)
    foot = rounded_box((2 * half, 2 * half, 0.04), 0.012, 1).moved(z=0.02).painted(2)
    orange, white = painted_material("#e2561b", 0.6), painted_material("#e6e6e2", 0.4)
    base = painted_material(rng.choose(("#c94d1a", "#232425")), 0.8)
    cone_hull = hulls.frustum((0.235 * h, 0.04), (0.045 * h, h), 12)
    shells = [cone_hull, hulls.box((-half, -half, 0.0), (half, half, 0.04))]
    return make_solid([*pieces, tip, foot], (orange, white, base), shells)


def post_box(rng: VariantRng) -> Solid:
    """A letter box on two legs or on a wall post. Slots: body, flap, legs."""
    w = rng.between(0.45, 0.6, "width_m")
    d = rng.between(0.3, 0.4, "depth_m")
    h = rng.between(0.6, 0.75, "height_m")
    z = rng.between(0.65, 0.8, "legs_m")
    body = rounded_box((d, w, h), 0.03, 2).moved(z=z + 0.5 * h)
    x = 0.5 * d
    flap = block((x, -0.4 * w, z + 0.68 * h), (x + 0.03, 0.4 * w, z + 0.82 * h), 0.008).painted(1)
    plate = facing_rectangle(x + 0.003, (-0.25 * w, 0.25 * w), (z + 0.25 * h, z + 0.5 * h), 1)
    legs = [block((-0.04, y - 0.03, 0.0), (0.04, y + 0.03, z + 0.05)) for y in (-0.3 * w, 0.3 * w)]
    schemes = (("#e0b21c", "#2b2b2b"), ("#b3201b", "#d8d6cf"), ("#274b8f", "#e0dfda"))
    color, trim = rng.choose(schemes)
    parts = [body, flap, plate, *(leg.painted(2) for leg in legs)]
    hull = hulls.box((-x, -0.5 * w, 0.0), (x, 0.5 * w, z + h))
    materials = (painted_material(color, 0.4), painted_material(trim, 0.5), GALVANISED)
    return make_solid(parts, materials, [hull])


def bus_stop(rng: VariantRng) -> Solid:
    """A shelter, open to +X, with a seat. Slots: frame, glass, roof, seat, panel."""
    half = 0.5 * rng.between(3.2, 4.2, "width_m")
    d = rng.between(1.3, 1.6, "depth_m")
    h = rng.between(2.35, 2.55, "height_m")
    x = 0.5 * d
    feet = [(-x, -half), (-x, -half / 3), (-x, half / 3), (-x, half), (x - 0.25, -half),
            (x - 0.25, half)]  # fmt: skip
    posts = [block((a - 0.03, y - 0.03, 0.0), (a + 0.03, y + 0.03, h)) for a, y in feet]
    edges = [-half + 2 * half * k / 3 for k in range(4)]
    panes = [
        block((-x - 0.006, a + 0.05, 0.25), (-x + 0.006, b - 0.05, h - 0.2))
        for a, b in pairwise(edges)
    ]
    panes.append(block((-x + 0.05, half - 0.006, 0.25), (x - 0.3, half + 0.006, h - 0.2)))
    roof = block((-x - 0.1, -half - 0.1, h), (x + 0.1, half + 0.1, h + 0.1), 0.02)
    seat = block((-x + 0.15, -0.6 * half, 0.42), (-x + 0.5, 0.6 * half, 0.46), 0.01)
    ys = (-0.4 * half, 0.4 * half)
    legs = [block((-x + 0.3, y - 0.03, 0.0), (-x + 0.36, y + 0.03, 0.42)) for y in ys]
    panel = block((-x + 0.05, -half - 0.05, 0.3), (x - 0.3, -half + 0.05, 2.1), 0.01)
    poster = [
        facing_rectangle(0.0, (-0.5, 0.5), (0.4, 2.0)).rotated("z", turn).moved(-0.15, -half + side)
        for turn, side in ((0.5 * math.pi, 0.055), (-0.5 * math.pi, -0.055))
    ]
    glass = asset_types.Material((0.9, 0.95, 0.93), roughness=0.05, transmission=1.0, role="glass")
    parts = [*posts, *(p.painted(1) for p in panes), roof.painted(2), seat.painted(3), *legs, panel]
    parts += [p.painted(4) for p in poster]
    wood = patterned_material("texture/wood_grain?seed=2", 1.2, 0.7, (0.8, 0.75, 0.7))
    art = replace(printed_material(f"texture/book_cover?seed={rng.seed % 32}", 0.35), role="sign")
    walls = [
        hulls.box((-x - 0.03, -half, 0.0), (-x + 0.03, half, h)),
        hulls.box((-x, -half, h), (x, half, h + 0.1)),
    ]
    frame = painted_material(rng.choose(_IRON_PAINTS), 0.45)
    return make_solid(parts, (frame, glass, painted_material("#5f6365", 0.5), wood, art), walls)


def cabinet(rng: VariantRng) -> Solid:
    """A distribution cabinet with two doors and a lid. Slots: body, seams, plinth."""
    w = rng.between(0.7, 1.5, "width_m")
    d = rng.between(0.3, 0.45, "depth_m")
    h = rng.between(0.95, 1.35, "height_m")
    x, y = 0.5 * d, 0.5 * w
    body = rounded_box((d, w, h - 0.15), 0.015, 1).moved(z=0.15 + 0.5 * (h - 0.15))
    lid = block((-x - 0.02, -y - 0.02, h - 0.04), (x + 0.02, y + 0.02, h + 0.015), 0.01)
    plinth = block((-x + 0.02, -y + 0.02, 0.0), (x - 0.02, y - 0.02, 0.16))
    seams = [facing_rectangle(x + 0.002, (-0.004, 0.004), (0.2, h - 0.08), 1)]
    across = (-y + 0.04, y - 0.04)
    seams += [facing_rectangle(x + 0.002, across, (z, z + 0.012), 1) for z in (0.22, h - 0.1)]
    handle = block((x, 0.05, 0.55 * h), (x + 0.025, 0.08, 0.55 * h + 0.14)).painted(1)
    grey = painted_material(rng.choose(("#8d9091", "#a5a79f", "#6f7a70", "#b0aea6")), 0.6)
    parts = [body, lid, plinth.painted(2), *seams, handle]
    concrete = patterned_material("texture/concrete?seed=3", 1.5, 0.9)
    hull = hulls.box((-x, -y, 0.0), (x, y, h))
    return make_solid(parts, (grey, painted_material("#3b3d3f", 0.6), concrete), [hull])


def bike_rack(rng: VariantRng) -> Solid:
    """A row of hoops; bicycles lean against them along X. Slot: hoops."""
    count, pitch = rng.choose((2, 3, 4, 5), "count"), rng.between(0.8, 1.0, "pitch_m")
    half, h = 0.5 * rng.between(0.7, 0.9, "width_m"), rng.between(0.75, 0.85, "height_m")
    bend = [(half, 0.0), (half, h - 0.15), (half - 0.04, h - 0.04), (half - 0.15, h)]
    hoop = tube([*((-x, 0.0, z) for x, z in bend), *((x, 0.0, z) for x, z in bend[::-1])], 0.024)
    at = [pitch * (k - 0.5 * (count - 1)) for k in range(count)]
    shells = [hulls.box((-half, -0.025 + y, 0.0), (half, 0.025 + y, h)) for y in at]
    finish = GALVANISED if rng.chance(0.7) else _ANTHRACITE
    return make_solid([hoop.moved(y=y) for y in at], (finish,), shells)


def _bollard_kind(seed: int) -> str:
    return ("steel", "iron", "stone", "steel")[seed % 4]


def _arm_head(height: float, reach: float, rise: float) -> tuple[Patch, Patch, se3.Vec3]:
    """An arm towards +X with a flat luminaire; its lens looks down."""
    top = height + rise
    path = [(0.0, 0.0, height - 0.3), (0.05 * reach, 0.0, height),
            (0.35 * reach, 0.0, height + 0.7 * rise), (reach, 0.0, top)]  # fmt: skip
    arm = tube(path, 0.032, 8)
    body = rounded_box((0.62, 0.26, 0.1), 0.03, 1).moved(reach + 0.25, 0.0, top)
    lens = block((reach + 0.02, -0.1, top - 0.062), (reach + 0.5, 0.1, top - 0.049))
    return join_patches([arm, body]), lens, (reach + 0.26, 0.0, top - 0.06)


def _post_top(height: float) -> tuple[Patch, Patch, se3.Vec3]:
    """A lantern on the mast's top."""
    eaves, foot = height + 0.42, height + 0.06
    roof = lathe([(0.0, eaves), (0.28, eaves), (0.26, height + 0.46), (0.0, height + 0.56)], 16)
    collar = cone((0.07, height - 0.05), (0.09, height + 0.08), 12)
    lens = lathe([(0.0, foot), (0.09, foot), (0.19, eaves), (0.0, eaves)], 16)
    return join_patches([roof, collar]), lens, (0.0, 0.0, height + 0.25)
