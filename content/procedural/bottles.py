"""Bottles and jars: bodies of revolution with a label, a closure and contents.

Kinds of bottles are rows of ``bottles.yaml``.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural import material_presets, vessel_contents
from gen_data.content.procedural.patches import Array, Patch, join_patches, make_centred_solid
from gen_data.content.procedural.surface_shapes import Point2, block, cone, fillet, grid, lathe
from gen_data.content.procedural.vessels import radius_at, subdivide
from gen_data.content.procedural.wear import draw_wear, dulled
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, variant_rng

# Width by height of the unrolled label; its texture is drawn at this aspect.
LABEL_ASPECT = 2.6
# Half of the angle that a label on the front covers [rad].
_FRONT_RAD = 1.0

# Label paper stands this much proud of the wall.
_PROUD_M = 0.0003
# Wall of a bottle between its outside and its contents.
_WALL_M = 0.0012
_SEGMENTS = 40


@dataclass(frozen=True, slots=True)
class BottleStyle:
    """Ranges of the dimensions of one kind of bottle.

    Attributes:
        height_m: Height without a pump or trigger.
        label_share: Lower and upper edge of the label, as shares of the height.
        shoulder: (radius as a share of the body's beyond the neck's, height as a share of the way
            from label to neck) of the points between body and neck.
        cap_m: Radius and height of the cap.
        depth: Extent along Y divided by extent along X.
        colors: Colours of the body; of a clear bottle, the tint of transmitted light.
        caps: Colours of the cap.
        clear: Whether it is transparent; then it contains one of ``drinks``.
        fill: Level of the drink as a share of the height below the neck's end.
        closures: ``screw``, ``crown``, ``pump``, ``trigger``, ``nozzle`` or ``spout``.
        labels: ``wrap`` all around, ``front``, or ``none``.
        ribs: Number of grooves around the body.
        crush: Depth of dents in the wall, as a share of the radius.
    """

    height_m: Point2
    radius_m: Point2
    neck_m: float
    neck_share: Point2
    label_share: Point2
    shoulder: tuple[Point2, ...]
    cap_m: Point2
    depth: float
    colors: tuple[str, ...]
    caps: tuple[str, ...]
    gloss: Point2 = (0.06, 0.15)
    clear: bool = False
    drinks: tuple[str, ...] = ()
    fill: Point2 = (0.9, 0.97)
    closures: tuple[str, ...] = ("screw",)
    labels: tuple[str, ...] = ("wrap",)
    ribs: int = 0
    crush: Point2 = (0.0, 0.0)


class BottleChoice(NamedTuple):
    """Draws of one bottle from the options of its kind; see ``BottleStyle``."""

    kind: str
    drink: str
    closure: str
    label: str


BOTTLES = load_table(__package__, "bottles", BottleStyle)


def choose_bottle(seed: int) -> BottleChoice:
    """Draw the kind, contents, closure and label of a bottle."""
    rng = variant_rng("bottle/choice", seed)
    kind = rng.turn(tuple(BOTTLES), "kind")
    style = BOTTLES[kind]
    drink = rng.choose(style.drinks, "drink") if style.clear else ""
    return BottleChoice(
        kind, drink, rng.choose(style.closures, "closure"), rng.choose(style.labels, "label")
    )


def bottle_facts(seed: int) -> Facts:
    """Kind, and the contents visible through a clear wall."""
    choice = choose_bottle(seed)
    return Facts(choice.kind, {"contents": choice.drink} if choice.drink else {})


def bottle(seed: int) -> Solid:
    """A bottle of one of the styles in ``BOTTLES``. Slots: body, label, cap, then contents."""
    rng, choice = variant_rng("bottle", seed), choose_bottle(seed)
    style = BOTTLES[choice.kind]
    height = rng.between(*style.height_m, "height_m")
    radius = rng.between(*style.radius_m, "radius_m")
    neck_z = height * rng.between(*style.neck_share)
    z0, z1 = height * style.label_share[0], min(height * style.label_share[1], neck_z - 0.01)
    shoulder = [
        (style.neck_m + r * (radius - style.neck_m), z1 + t * (neck_z - z1))
        for r, t in style.shoulder
    ]
    cap_radius, cap_height = style.cap_m
    cap_z, neck_top = height - cap_height, height - 0.4 * cap_height
    upper = [*shoulder, (style.neck_m, neck_z), (style.neck_m, neck_top)]
    wall = _Wall(radius, (z0, z1), upper, [0.06] * (len(upper) - 1))
    closure, cap_parts = _CLOSURES[choice.closure](cap_radius, cap_z, height)
    dented = style.crush[1] > 0.0
    patches = [
        *_make_wall(wall, choice.label, style.ribs, fine=dented),
        lathe([(style.neck_m, neck_top), (0.0, neck_top)], _SEGMENTS, 0),
        closure.painted(2),
    ]
    foot = [(0.93 * radius, 0.0), (radius, 0.008), (radius, z1)]
    mouth = (max(style.neck_m, 0.96 * cap_radius), neck_z + 0.004)
    side = subdivide([(radius, 0.008), (radius, z1)], 0.022)[1:-1] if dented else []
    foot[2:2] = side
    stages = [*foot, *shoulder, mouth, (cap_radius, cap_z), (0.97 * cap_radius, height)]
    flat = np.array([1.0, style.depth, 1.0])
    parts = [hull * flat for hull in (*hulls.stack(_drop_level_stages(stages)), *cap_parts)]
    materials = _bottle_materials(style, choice, seed, rng)
    if choice.drink:
        level = 0.01 + rng.between(*style.fill) * (neck_z - 0.01)
        patches.append(_contents(wall, level, fine=dented))
        materials.append(vessel_contents.liquid(vessel_contents.DRINKS[choice.drink], rng))
    if dented:
        dents = _draw_dents((0.012, neck_z - 0.01), rng.between(*style.crush), rng)
        patches = [replace(patch, corners_m=dents.press(patch.corners_m)) for patch in patches]
        parts = [dents.press(part) for part in parts]
    flattened = [patch.scaled(1.0, style.depth, 1.0) for patch in patches]
    return make_centred_solid(flattened, materials, parts)


class _Dents(NamedTuple):
    """Dents in a wall about Z.

    Attributes:
        places: Angle about Z [rad] and height [m] of each dent.
        depths: Depths as shares of the radius.
        widths: Half widths, an angle [rad] and a height [m].
        between_m: Heights of the lowest and highest points that move.
    """

    places: Array
    depths: Array
    widths: Array
    between_m: Point2

    def press(self, points_m: Array) -> Array:
        """The points, shape [..., 3], moved towards the axis."""
        x, y, z = (points_m[..., i, None] for i in range(3))
        turn = np.arctan2(y, x) - self.places[:, 0]
        turn = np.mod(turn + math.pi, 2.0 * math.pi) - math.pi
        away = (turn / self.widths[:, 0]) ** 2 + ((z - self.places[:, 1]) / self.widths[:, 1]) ** 2
        low, high = self.between_m
        free = np.clip(np.minimum(z - low, high - z) / 0.02, 0.0, 1.0)[..., 0]
        share = 1.0 - free * np.minimum((self.depths * np.exp(-away)).sum(axis=-1), 0.4)
        return np.asarray(points_m * np.stack([share, share, np.ones_like(share)], axis=-1))


def _draw_dents(between_m: Point2, depth: float, rng: VariantRng) -> _Dents:
    """Four broad dents, where fingers pressed, and eight small ones (assumed)."""
    low, high = between_m
    places, depths, widths = [], [], []
    for k in range(12):
        broad = k < 4
        places.append((rng.between(-math.pi, math.pi), rng.between(low + 0.02, high)))
        depths.append(depth * rng.between(0.6, 1.0) * (1.0 if broad else 0.45))
        widths.append((rng.between(0.5, 0.9), rng.between(0.02, 0.04)) if broad
                      else (rng.between(0.2, 0.4), rng.between(0.007, 0.015)))  # fmt: skip
    return _Dents(np.array(places), np.array(depths), np.array(widths), between_m)


def _bottle_materials(
    style: BottleStyle, choice: BottleChoice, seed: int, rng: VariantRng
) -> list[Material]:
    color, gloss = material_presets.draw_linear(style.colors, 0.1, rng), rng.between(*style.gloss)
    body = Material(color, gloss)
    if style.clear:
        body = Material(color, 0.04, transmission=1.0, ior=1.5)
    elif choice.kind == "flask" and min(color) > 0.4:
        body = material_presets.metal_material(color, gloss)
    name = "front_label" if choice.label == "front" else "label"
    rough = dulled(rng.between(0.35, 0.6), draw_wear(name, seed))
    label = material_presets.printed_material(f"texture/{name}?seed={seed}", rough)
    cap = material_presets.plastic_material(rng, style.caps)
    if choice.closure == "crown":
        cap = material_presets.metal_material(
            material_presets.draw_linear(style.caps, 0.05, rng), 0.3
        )
    return [body, label, cap]


def jar(seed: int) -> Solid:
    """A preserving jar with a twist-off lid. Slots: body, label, lid, then contents."""
    rng = variant_rng("jar", seed)
    radius, height = rng.between(0.027, 0.045, "radius_m"), rng.between(0.07, 0.15, "height_m")
    top, lid_radius, mouth = height - 0.014, 0.93 * radius, 0.88 * radius
    neck = rng.choose((0.74, 0.8, 0.84))
    upper = [(radius, neck * height), (mouth, top - 0.003), (mouth, top + 0.004)]
    style = rng.choose(("wrap", "front"), "style")
    wall = _Wall(radius, (0.2 * height, (neck - 0.14) * height), upper, [0.02, 0.006])
    patches = [
        *_make_wall(wall, style),
        lathe([(mouth, top + 0.004), (0.0, top + 0.004)], _SEGMENTS, 0),
        _lid(lid_radius, top, height),
    ]
    filling = material_presets.draw_linear(material_presets.PALETTES["fillings"], 0.15, rng)
    body = Material(filling, rng.between(0.06, 0.12))
    name = "front_label" if style == "front" else "label"
    rough = dulled(rng.between(0.45, 0.65), draw_wear(name, seed + 1000))
    label = material_presets.printed_material(f"texture/{name}?seed={seed + 1000}", rough)
    metals = (
        material_presets.metal_material(color, 0.3)
        for color in ((0.83, 0.69, 0.35), material_presets.STEEL)
    )
    lid = rng.choose((*metals, material_presets.plastic_material(rng, material_presets.CAPS)))
    materials = [body, label, lid]
    if rng.chance(0.6):
        # Half-empty glass, with the filling behind it.
        materials[0] = Material((0.96, 0.98, 0.97), 0.04, transmission=1.0, ior=1.5)
        level = rng.between(0.25, 0.97) * neck * height
        patches.append(_contents(wall, max(0.012, level)))
        rough = rng.between(0.2, 0.7)
        materials.append(Material(filling, rough, printed=True, role=vessel_contents.CONTENTS))
    stages = [(0.92 * radius, 0.0), (radius, 0.008), (radius, neck * height), (lid_radius, top),
              (lid_radius, height)]  # fmt: skip
    return make_centred_solid(patches, materials, hulls.stack(stages))


class _Wall(NamedTuple):
    """Outside of a bottle or jar.

    Attributes:
        radius: Radius of the body [m].
        label: Heights of the label's edges [m].
        upper: Points (radius, z) above the body [m].
        radii: Radii of the arcs at these points, except the last [m].
    """

    radius: float
    label: Point2
    upper: list[Point2]
    radii: list[float]

    def profile(self) -> list[Point2]:
        lower, rest = self.below(0.0), self.above(0.0)
        return [*lower, *rest]

    def below(self, proud: float) -> list[Point2]:
        """From the axis to the label's lower edge, which stands proud."""
        radius, z0 = self.radius, self.label[0]
        foot = [(0.0, 0.004), (0.6 * radius, 0.003), (0.72 * radius, 0.0), (0.93 * radius, 0.0)]
        lower = [*foot, (radius, 0.008), (radius, z0 - _PROUD_M), (radius + proud, z0)]
        return fillet(lower, [0.0, 0.0, 0.0, 0.004, 0.01, 0.0, 0.0], 3)

    def above(self, proud: float) -> list[Point2]:
        """From the label's upper edge to the mouth."""
        radius, z1 = self.radius, self.label[1]
        rest = [(radius + proud, z1), (radius, z1 + _PROUD_M), *self.upper]
        return fillet(rest, [0.0, 0.0, *self.radii, 0.0], 3)


def _make_wall(wall: _Wall, label: str, ribs: int = 0, *, fine: bool = False) -> list[Patch]:
    """Bottom and wall in slot 0, the label in slot 1; fine walls have points for dents."""
    z0, z1 = wall.label
    proud = _PROUD_M if label == "wrap" else 0.0
    lower, upper = wall.below(proud), wall.above(proud)
    band = [(wall.radius + proud, z0), (wall.radius + proud, z1)]
    if ribs:
        lower, upper = (_groove(line, wall.radius, ribs) for line in (lower, upper))
        band = _groove(band, wall.radius, ribs) if label == "none" else band
    if fine:
        lower, band, upper = (_fine(line) for line in (lower, band, upper))
    patches = [
        lathe(lower, _SEGMENTS, 0),
        lathe(band, _SEGMENTS, 1 if label == "wrap" else 0, v=(0.0, 1.0)),
        lathe(upper, _SEGMENTS, 0),
    ]
    if label == "front":
        patches.append(_front_label(wall.radius, z0, z1))
    return patches


def _fine(line: list[Point2]) -> list[Point2]:
    """The profile with points for dents, and the very ends that its neighbours have."""
    return [line[0], *subdivide(line, 0.007)[1:-1], line[-1]]


def _groove(line: list[Point2], radius: float, ribs: int) -> list[Point2]:
    """The profile with round grooves where it runs along the body."""
    pitch = 0.12 / ribs
    fine = [line[0], *subdivide(line, 0.2 * pitch)[1:-1], line[-1]]
    return [
        (r - 0.0012 * (0.5 - 0.5 * math.cos(2 * math.pi * z / pitch)), z)
        if abs(r - radius) < 1e-6 and z > 0.012
        else (r, z)
        for r, z in fine
    ]


def _front_label(radius: float, low: float, high: float) -> Patch:
    """A closed sheet around the front, which is at +X; its outside shows the whole image."""
    turn = np.linspace(-_FRONT_RAD, _FRONT_RAD, 17)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    rows = [(radius - _PROUD_M, low), (radius + _PROUD_M, low), (radius + _PROUD_M, high),
            (radius - _PROUD_M, high), (radius - _PROUD_M, low)]  # fmt: skip
    points = np.array([np.insert(r * circle, 2, z, axis=1) for r, z in rows])
    sheet = grid(points, v=np.array([0.0, 0.0, 1.0, 1.0, 0.0]), slot=1)
    ends = [grid(points[[[0, 1], [3, 2]], [[i, i], [i, i]]], slot=1) for i in (0, -1)]
    return join_patches([sheet, ends[0], ends[1].flipped()])


def _contents(wall: _Wall, level: float, *, fine: bool = False) -> Patch:
    """Contents of a bottle up to a level; slot 3."""
    profile = [(r, z) for r, z in wall.profile() if r > 0.5 * wall.radius or z > 0.02]
    low = 0.006
    between = [(r, z) for r, z in profile if low < z < level - 5e-4]
    side = [(radius_at(profile, low), low), *between, (radius_at(profile, level), level)]
    inner = [(r - _WALL_M, z) for r, z in side]
    edge = inner[-1][0]
    top = [(0.9 * edge, level - 0.0006), (0.0, level - 0.0006)]
    return lathe([(0.0, low), *(subdivide(inner, 0.007) if fine else inner), *top], _SEGMENTS, 3)


Closure = tuple[Patch, list[Array]]


def _screw(radius: float, low: float, high: float) -> Closure:
    return _cap(radius, low, high), []


def _crown(radius: float, low: float, high: float) -> Closure:
    """A crown cork; its skirt has 21 teeth, here 20."""
    profile = [(0.0, low), (radius, low), (0.86 * radius, high - 0.001), (0.0, high)]
    made = lathe(fillet(profile, [0.0, 0.0, 0.002, 0.0], 3), 40)
    corners = made.corners_m.copy()
    turn = np.arctan2(corners[..., 1], corners[..., 0])
    skirt = np.clip((high - corners[..., 2]) / (high - low), 0.0, 1.0)
    corners[..., :2] *= (1.0 + 0.04 * skirt * (np.cos(20.0 * turn) - 1.0))[..., None]
    return Patch(corners, made.uvs, made.slots), []


def _pump(radius: float, low: float, high: float) -> Closure:
    """A dispenser: collar, stem, and a head with a spout towards +X."""
    top = high + 0.028
    spout = block((0.0, -0.0055, top), (0.04, 0.0055, top + 0.009), 0.002)
    tip = block((0.034, -0.004, top - 0.006), (0.04, 0.004, top + 0.002), 0.001)
    head = cone((0.0105, top - 0.002), (0.0095, top + 0.0115), 20)
    stem = cone((0.0042, high - 0.002), (0.0042, top), 12)
    hull = hulls.box((-0.0095, -0.0095, top - 0.002), (0.04, 0.0095, top + 0.0115))
    post = hulls.frustum((0.0042, high), (0.0042, top), 8)
    return join_patches([_cap(radius, low, high), stem, head, spout, tip]), [post, hull]


def _trigger(radius: float, low: float, high: float) -> Closure:
    """A spray head: collar, body with a nozzle towards +X, and the trigger below it."""
    z = high + 0.022
    body = block((-0.034, -0.0105, z), (0.03, 0.0105, z + 0.022), 0.005)
    nose = block((0.028, -0.007, z + 0.005), (0.042, 0.007, z + 0.019), 0.003)
    neck = block((-0.014, -0.009, high - 0.004), (0.012, 0.009, z + 0.004), 0.003)
    lever = block((0.016, -0.006, z - 0.042), (0.023, 0.006, z + 0.004), 0.002)
    lever = lever.rotated("y", -0.22)
    lever = lever.moved(x=0.034 - float(lever.bounds_m()[1][0]))
    low_m, high_m = (tuple(corner.tolist()) for corner in lever.bounds_m())
    parts = [hulls.box((-0.034, -0.0105, z), (0.042, 0.0105, z + 0.022)),
             hulls.box((-0.014, -0.009, high - 0.004), (0.012, 0.009, z + 0.004)),
             hulls.box(low_m, high_m)]  # fmt: skip
    return join_patches([_cap(radius, low, high), neck, body, nose, lever]), parts


def _nozzle(radius: float, low: float, high: float) -> Closure:
    """A sports cap: a dome with a pull-up nozzle."""
    dome = [(0.0, low), (radius, low), (radius, high - 0.002), (0.6 * radius, high + 0.006),
            (0.0105, high + 0.008), (0.0095, high + 0.022), (0.0075, high + 0.026),
            (0.0, high + 0.026)]  # fmt: skip
    made = lathe(fillet(dome, [0.0, 0.0008, 0.004, 0.004, 0.002, 0.001, 0.002, 0.0], 3), 40)
    parts = hulls.stack([(0.97 * radius, high - 0.002), (0.6 * radius, high + 0.006),
                         (0.0105, high + 0.008), (0.0085, high + 0.026)])  # fmt: skip
    return made, parts


def _spout(radius: float, low: float, high: float) -> Closure:
    """A cap that ends in a cone, as of mustard."""
    cap = [(0.0, low), (radius, low), (0.95 * radius, high - 0.004), (0.35 * radius, high + 0.004),
           (0.003, high + 0.026), (0.0, high + 0.026)]  # fmt: skip
    made = lathe(fillet(cap, [0.0, 0.0008, 0.003, 0.004, 0.001, 0.0], 3), 40)
    parts = hulls.stack([(0.95 * radius, high - 0.004), (0.35 * radius, high + 0.004),
                         (0.003, high + 0.026)])  # fmt: skip
    return made, parts


_CLOSURES: Mapping[str, Callable[[float, float, float], Closure]] = {
    "screw": _screw, "crown": _crown, "pump": _pump, "trigger": _trigger, "nozzle": _nozzle,
    "spout": _spout,
}  # fmt: skip


def _cap(radius: float, low: float, high: float) -> Patch:
    """A screw cap, closed below, with grooves for the grip."""
    profile = [(0.0, low), (radius, low), (0.97 * radius, high), (0.0, high)]
    made = lathe(subdivide(fillet(profile, [0.0, 0.0008, 0.002, 0.0], 2), 0.03), 48)
    corners = made.corners_m.copy()
    turn = np.arctan2(corners[..., 1], corners[..., 0])
    corners[..., :2] *= (1.0 - 0.025 * (0.5 - 0.5 * np.cos(24.0 * turn)))[..., None]
    return Patch(corners, made.uvs, made.slots)


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
