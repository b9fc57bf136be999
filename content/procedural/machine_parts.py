"""Machine parts for bin picking; sizes follow metric standard parts."""

import math
from dataclasses import dataclass

import numpy as np

from gen_data.assets.family import Solid, axis_symmetries
from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import (
    METALS,
    PALETTES,
    metal_material,
    plastic_material,
)
from gen_data.content.procedural.patches import (
    Array,
    Patch,
    join_patches,
    make_centred_solid,
    rotate,
)
from gen_data.content.procedural.surface_shapes import (
    Point2,
    circle,
    cone,
    extrude,
    fillet,
    lathe,
    rounded_box,
    sweep,
)
from gen_data.core.asset_types import Material, Symmetry
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

_SIZES = load_table(__package__, "metric_parts", tuple[tuple[float, ...], ...])


def hex_bolt(rng: VariantRng) -> Solid:
    """A hexagon bolt standing on its head. Slot: body."""
    d, flats, head, _, pitch = (0.001 * v for v in in_turn(_SIZES["hexagons"], rng.seed))
    length = d * rng.choose((2.0, 3.0, 4.0, 5.0), "length_by_diameter")
    threaded = min(length - d, max(2 * d, 0.55 * length))
    corner = flats / math.sqrt(3)
    end = head + length
    foot = head - 0.0005
    profile: list[Point2] = [(0.0, foot), (0.5 * d, foot), (0.5 * d, end - threaded)]
    root, turns = 0.5 * d - 0.61 * pitch, max(3, int((threaded - pitch) / pitch))
    step = (threaded - pitch) / turns
    for i in range(turns):
        z = end - threaded + i * step
        profile += [(root, z + 0.5 * step), (0.5 * d, z + step)]
    profile += [(root, end), (0.0, end)]
    patches = [extrude(circle(corner, 6), head, 0.06 * flats), lathe(profile, 20)]
    shank = hulls.frustum((0.5 * d, head), (0.5 * d, end), 12)
    parts = [hulls.frustum((corner, 0.0), (corner, head), 6), shank]
    return make_centred_solid(patches, (_worn_metal("fasteners", rng),), parts, crease_deg=25.0)


def nut(rng: VariantRng) -> Solid:
    """A hexagon nut. Slot: body."""
    d, flats, _, height, _ = (0.001 * v for v in in_turn(_SIZES["hexagons"], rng.seed))
    corner = flats / math.sqrt(3)
    body = extrude(circle(corner, 6), height, 0.05 * flats, [circle(0.46 * d, 24)])
    wedges = hulls.ring((0.46 * d, corner, 0.0), (0.46 * d, corner, height), 6)
    # A hexagon's flats are its wedges: leave out the round middle point.
    flat = [hull[[0, 1, 2, 4, 5, 6, 7, 9]] for hull in wedges]
    turned = [rotate(hull, "z", math.pi / 6) for hull in flat]
    return make_centred_solid([body], (_worn_metal("fasteners", rng),), turned, crease_deg=25.0)


def washer(rng: VariantRng) -> Solid:
    """A flat washer. Slot: body."""
    _, inner, outer, thick = (0.001 * v for v in in_turn(_SIZES["washers"], rng.seed))
    r, big = 0.5 * inner, 0.5 * outer
    seam = (r, 0.5 * thick)
    section = [seam, (r, 0.0), (big, 0.0), (big, thick), (r, thick), seam]
    wedges = hulls.ring((r, big, 0.0), (r, big, thick), 8)
    body = lathe(fillet(section, 0.12 * thick, 1), 36)
    return make_centred_solid([body], (_worn_metal("fasteners", rng),), wedges)


def stepped_shaft(rng: VariantRng) -> Solid:
    """A turned shaft of several diameters, lying along X. Slot: body."""
    radii = [rng.between(low, high) for low, high in _SIZES["shaft_radii"]][
        : rng.choose((3, 4, 5), "steps")
    ]
    chamfer, z = 0.0008, 0.0
    profile: list[Point2] = [(0.0, 0.0)]
    parts = []
    for r in radii:
        length = rng.between(0.012, 0.04)
        profile += [(r - chamfer, z), (r, z + chamfer), (r, z + length - chamfer),
                    (r - chamfer, z + length)]  # fmt: skip
        parts.append(hulls.frustum((r, z), (r, z + length)))
        z += length
    profile.append((0.0, z))
    turned = [rotate(part, "y", 0.5 * math.pi) for part in parts]
    body = lathe(profile, 40).rotated("y", 0.5 * math.pi)
    return make_centred_solid([body], (_worn_metal("machined", rng),), turned)


def pipe_elbow(rng: VariantRng) -> Solid:
    """A 90 degree pipe elbow with collars, flat on the ground. Slot: body."""
    outer = rng.between(0.01, 0.018, "outer_m")
    inner, bend = 0.78 * outer, outer * rng.between(1.5, 2.4)
    straight, collar = 0.8 * outer, outer * 1.22
    turn = np.linspace(0.0, 0.5 * math.pi, 13)
    arc = np.stack([bend * np.sin(turn), bend * (1 - np.cos(turn)), 0 * turn], axis=1)
    path = np.concatenate([[(-straight, 0, 0)], arc, [(bend, bend + straight, 0)]])
    wall = sweep(path, circle(outer, 28), capped=False)
    bore = sweep(path, circle(inner, 28), capped=False).flipped()
    ring = _collar(inner, collar, 0.55 * outer).moved(z=-0.55 * outer)
    first = ring.rotated("y", -0.5 * math.pi).moved(-straight)
    second = ring.rotated("x", -0.5 * math.pi).moved(bend, bend + straight)
    parts = [
        _tube_piece(path[a : b + 1], outer) for a, b in ((0, 1), (1, 5), (5, 9), (9, 13), (13, 14))
    ]
    band = hulls.frustum((collar, -0.55 * outer), (collar, 0.0))
    parts += [
        rotate(band, "y", -0.5 * math.pi) + np.array([-straight, 0, 0]),
        rotate(band, "x", -0.5 * math.pi) + np.array([bend, bend + straight, 0]),
    ]
    plastic = plastic_material(rng, PALETTES["abs"])
    finish = rng.choose((*(metal_material(*metal) for metal in METALS["pipes"]), plastic))
    return make_centred_solid([wall, bore, first, second], (finish,), parts)


def pipe_elbow_symmetries(seed: int) -> tuple[Symmetry, ...]:
    """Half a turn about the bisector of its two legs exchanges them."""
    del seed
    half = math.sqrt(0.5)
    return (Symmetry((-half, half, 0.0), 2),)


def bracket(rng: VariantRng) -> Solid:
    """An angle bracket with screw holes. Slot: body."""
    a, b = rng.between(0.04, 0.07), rng.between(0.03, 0.06)
    width, thick = rng.between(0.02, 0.035, "width_m"), rng.between(0.002, 0.004, "thickness_m")
    hole = min(0.16 * width, 0.004)
    foot = _holed_plate(a, width, thick, hole)
    upright = _holed_plate(b, width, thick, hole).rotated("y", -0.5 * math.pi).moved(thick)
    finish = metal_material(*rng.choose(METALS["brackets"]))
    half = 0.5 * width
    ends = ((a, half, thick), (thick, half, b))
    parts = [hulls.box((0.0, -half, 0.0), end) for end in ends]
    return make_centred_solid([foot, upright], (finish,), parts)


def gear(rng: VariantRng) -> Solid:
    """A spur gear with hub and bore. Slot: body."""
    shape = _draw_gear(rng)
    teeth, module, thick, hub = shape.teeth, shape.module_m, shape.thick_m, shape.hub_m
    pitch, bore = 0.5 * teeth * module, shape.bore_m
    tip, root = pitch + module, pitch - 1.2 * module
    flank = ((-0.34, root), (-0.25, pitch), (-0.13, tip))
    tooth = (*flank, *((-share, r) for share, r in flank[::-1]))
    turns = [(2 * math.pi * (i + share) / teeth, r) for i in range(teeth) for share, r in tooth]
    outline = [(r * math.cos(turn), r * math.sin(turn)) for turn, r in turns]
    disc = extrude(np.array(outline), thick, 0.0004, [circle(bore, 28)])
    patches, parts = [disc], [hulls.frustum((tip, 0.0), (tip, thick), 24)]
    if hub:
        outer = 0.5 * (bore + root)
        patches.append(_collar(bore, outer, hub - thick).moved(z=thick))
        parts.append(hulls.frustum((outer, thick), (outer, hub)))
    return make_centred_solid(patches, (_machined(rng, 0.3),), parts, crease_deg=30.0)


def gear_symmetries(seed: int) -> tuple[Symmetry, ...]:
    """A turn from tooth to tooth; without a hub, also half a turn that exchanges its faces."""
    shape = _draw_gear(variant_rng("gear", seed))
    return axis_symmetries(z=shape.teeth, **({} if shape.hub_m else {"x": 2}))


@dataclass(frozen=True, slots=True)
class _Gear:
    """Measures of a gear [m]; a hub of 0 is none, else its height with the disc."""

    teeth: int
    module_m: float
    thick_m: float
    bore_m: float
    hub_m: float


def _draw_gear(rng: VariantRng) -> _Gear:
    teeth = rng.choose((14, 16, 18, 20, 24), "teeth")
    module = rng.choose((0.0015, 0.002, 0.0025), "module_m")
    thick, pitch = rng.between(0.006, 0.014, "thickness_m"), 0.5 * teeth * module
    bore = rng.between(0.25, 0.35) * pitch
    hub = thick + rng.between(0.004, 0.01) if rng.chance(0.6) else 0.0
    return _Gear(teeth, module, thick, bore, hub)


def flange(rng: VariantRng) -> Solid:
    """A pipe flange with bolt holes and a neck. Slot: body."""
    radius, thick, count = _draw_flange(rng)
    bore = 0.42 * radius
    bolt, at = 0.1 * radius, 0.76 * radius
    holes = [circle(bore, 32)]
    for i in range(count):
        turn = 2 * math.pi * (i + 0.5) / count
        # Turned a little: no three points of the triangulation may be collinear.
        holes.append(circle(bolt, 12, (at * math.cos(turn), at * math.sin(turn)), 0.37 + 0.1 * i))
    disc = extrude(circle(radius, 56), thick, 0.0006, holes)
    neck, rise = 0.56 * radius, rng.between(0.3, 0.6) * radius
    collar = _collar(bore, neck, rise).moved(z=thick)
    parts = [
        *hulls.ring((bore, radius, 0.0), (bore, radius, thick), 12),
        *hulls.ring((bore, neck, thick), (bore, neck, thick + rise), 8),
    ]
    return make_centred_solid([disc, collar], (_worn_metal("machined", rng),), parts)


def flange_symmetries(seed: int) -> tuple[Symmetry, ...]:
    """A turn from bolt hole to bolt hole."""
    _, _, count = _draw_flange(variant_rng("flange", seed))
    return axis_symmetries(z=count)


def _draw_flange(rng: VariantRng) -> tuple[float, float, int]:
    """Radius and thickness [m] of the disc, and the number of its bolt holes."""
    radius, thick = rng.between(0.03, 0.045, "radius_m"), rng.between(0.005, 0.009, "thickness_m")
    return radius, thick, rng.choose((4, 4, 6, 8))


def connector(rng: VariantRng) -> Solid:
    """A block with round ports on three to six sides. Slots: body, ports."""
    side, reach, ports = _draw_connector(rng)
    port = 0.32 * side
    body = rounded_box((side, side, side), 0.06 * side, 2)
    stub = _collar(0.7 * port, port, reach, 22).moved(z=0.5 * side)
    level = 0.5 * side + 0.3 * reach
    plug = cone((0.72 * port, 0.5 * side - 0.001), (0.72 * port, level), 22)
    pieces = join_patches([stub.painted(1), plug])
    band = hulls.frustum((port, 0.5 * side), (port, 0.5 * side + reach), 16)
    quarter, half = 0.5 * math.pi, 0.5 * side
    turns = [("y", 0.0), ("y", quarter), ("y", -quarter), ("x", quarter), ("x", -quarter),
             ("y", math.pi)][:ports]  # fmt: skip
    cube = hulls.box((-half, -half, -half), (half, half, half))
    parts = [cube, *(rotate(band, axis, turn) for axis, turn in turns)]
    block = _machined(rng, 0.5)
    finish = rng.choose((*(metal_material(*metal) for metal in METALS["ports"]), block))
    stubs = (pieces.rotated(axis, turn) for axis, turn in turns)
    return make_centred_solid([body, *stubs], (block, finish), parts)


def connector_symmetries(seed: int) -> tuple[Symmetry, ...]:
    """Turns of a cube that keep the sides with ports, which are +Z, +X, -X, -Y, +Y, -Z in turn."""
    _, _, ports = _draw_connector(variant_rng("connector", seed))
    if ports == 4:
        half = math.sqrt(0.5)
        return (Symmetry((0.0, -half, half), 2),)
    return axis_symmetries(**{3: {"z": 2}, 5: {"z": 4}, 6: {"z": 4, "x": 4}}[ports])


def _draw_connector(rng: VariantRng) -> tuple[float, float, int]:
    """Side of the block and reach of the ports [m], and their number."""
    side = rng.between(0.022, 0.034, "side_m")
    reach = rng.between(0.2, 0.45) * side
    return side, reach, rng.choose((3, 4, 5, 6), "ports")


def _worn_metal(kind: str, rng: VariantRng) -> Material:
    """One of the metals that are usual for a kind of part."""
    color, rough = rng.choose(METALS[kind])
    return metal_material(color, rough * rng.between(0.85, 1.2))


def _machined(rng: VariantRng, plastic: float) -> Material:
    """Turned or milled metal, or plastic with the given probability."""
    if rng.chance(plastic):
        return plastic_material(rng, PALETTES["abs"])
    return _worn_metal("machined", rng)


def _collar(bore: float, outer: float, height: float, segments: int = 28) -> Patch:
    """A closed ring from z = 0 to ``height``, its outer edges broken."""
    c = 0.06 * outer
    profile = [(bore, height), (bore, 0.0), (outer - c, 0.0), (outer, c), (outer, height - c),
               (outer - c, height), (bore, height)]  # fmt: skip
    return lathe(profile, segments)


def _holed_plate(length: float, width: float, thick: float, hole: float) -> Patch:
    """A plate from x = 0, its far corners rounded, with two holes."""
    half, r = 0.5 * width, 0.3 * width
    outline = [(0.0, half), (0.0, -half)]
    for sign, start in ((-1.0, -0.5 * math.pi), (1.0, 0.0)):
        for turn in (start + 0.5 * math.pi * i / 5 for i in range(6)):
            x, y = length - r, sign * (half - r)
            outline.append((x + r * math.cos(turn), y + r * math.sin(turn)))
    # Turned a little: no three points of the triangulation may be collinear.
    holes = [circle(hole, 14, (share * length, 0.0), share) for share in (0.42, 0.78)]
    return extrude(np.array(outline), thick, 0.12 * thick, holes)


def _tube_piece(path: Array, radius: float) -> Array:
    """Convex hull points of a piece of pipe in the plane z = 0."""
    tube = sweep(path, circle(radius, 16), capped=False)
    return hulls.extreme(tube.corners_m, 48)
