"""Layers over a body: visible skin, eyes and garments."""

import math
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from gen_data.content.people.body import Array, BodyTemplate, Indices
from gen_data.content.people.edges import Collar, Surface, add_collar, add_tufts, border_edges, calm
from gen_data.content.people.hair import hair_layers
from gen_data.content.people.head_layout import lay_out_eyes, lay_out_head
from gen_data.content.people.layer import Field, Layer, Profile
from gen_data.content.people.person import Outfit, Person
from gen_data.content.people.posing import vertex_normals
from gen_data.content.people.shoe_textures import lay_out_shoes
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng

_WAVES = 7
_THICKNESS_M = {"tshirt": 0.009, "shirt": 0.01, "jacket": 0.018, "coat": 0.018, "dress": 0.006}
"""How far garments stand off the chest, the air under them included."""
_SMOOTHING = (0.55, -0.57)
"""A step that smooths and shrinks, and one that takes the shrinking back."""


def layers(person: Person) -> tuple[Layer, ...]:
    """All visible layers of a person, from the skin outwards."""
    outfit = person.outfit
    return (
        _skin(person),
        _eyes(person),
        *hair_layers(person),
        *_bottoms(outfit),
        *_tops(outfit),
        _shoes(outfit),
    )


def displace_layer(body: BodyTemplate, layer: Layer, points_m: Array, rng: VariantRng) -> Surface:
    """One layer on an unposed body.

    Args:
        body: The template.
        layer: Layer to make.
        points_m: The template in the person's shape [m], shape [points, 3].
        rng: Draws its wrinkles and tufts.
    """
    phases = 2.0 * math.pi * np.array([rng.random() for _ in range(_WAVES)])
    used, faces, slots, border = _topology(body, tuple(z for z, _ in layer.zones), layer.keeps)
    places, template = points_m[used], body.points_m[used]
    if layer.smoothings:
        places = _smooth(places, faces, border, layer.smoothings)
    normals = calm(vertex_normals(places, faces), border)
    if any(distance for _, distance in layer.profile):
        places = places + _distances(layer, template, border, phases)[:, None] * normals
    sheet = Surface(used, places, template, normals, faces, slots)
    if layer.collar:
        sheet = add_collar(sheet, layer.collar, border, _NECK_Z_M)
    if layer.tufts:
        sheet = add_tufts(sheet, layer.tufts, border, rng)
    return sheet


@lru_cache(maxsize=128)
def _topology(
    body: BodyTemplate, zones: tuple[str, ...], keeps: Field | None
) -> tuple[Indices, Indices, Indices, Indices]:
    """Points used by zones, faces into them, the zone of each face, edges of the border.

    It is the same for everybody who wears the same: people of one body differ in places only.
    """
    parts = [(k, body.faces[zone]) for k, zone in enumerate(zones) if zone in body.faces]
    faces = np.concatenate([part for _, part in parts])
    slots = np.concatenate([np.full(len(part), k, dtype=np.int64) for k, part in parts])
    if keeps:
        kept = keeps(body.points_m[faces].mean(axis=1))
        faces, slots = faces[kept], slots[kept]
    used, local = np.unique(faces, return_inverse=True)
    local = local.reshape(-1, 3)
    return used, local, slots, border_edges(local)


def _distances(layer: Layer, template_m: Array, border: Indices, phases: Array) -> Array:
    """How far the vertices of a layer stand off the body [m], shape [n]."""
    heights, distances = zip(*layer.profile, strict=True)
    off: Array = np.interp(template_m[:, 2], heights, distances)
    if layer.folds_m:
        off += layer.folds_m * _wrinkles(template_m * layer.waves_per_m, phases)
    if layer.relief:
        off *= layer.relief(template_m)
    if layer.tapered:
        off[border] = 0.0
    return off


def _skin(person: Person) -> Layer:
    outfit = person.outfit
    face = Material(
        _lifted(person.skin, _FACE_LIFT), 0.48, specular=0.4,
        texture=f"texture/face?seed={person.face}", role="skin",
    )  # fmt: skip
    skin = Material(
        _lifted(person.skin, _SKIN_LIFT), 0.5, specular=0.4,
        texture="texture/skin_relief?seed=0", texture_scale_m=0.3, role="skin",
    )  # fmt: skip
    r, g, b = skin.base_color
    lips = replace(skin, base_color=(0.82 * r, 0.55 * g, 0.55 * b), roughness=0.4)
    x, y, z = ((1.0 - 0.45) * p + 0.45 * q for p, q in zip(person.hair, person.skin, strict=True))
    brows = Material(base_color=(x, y, z), roughness=0.8, role="hair")
    zones = [("face", face), ("lips", lips), ("brows", brows), ("hands", skin)]
    if person.haircut in ("bald", "horseshoe") and not outfit.headwear:
        zones.append(("scalp", face))
    if not outfit.sleeves:
        zones.append(("arms", skin))
    if outfit.bottom in ("shorts", "skirt", "none"):
        stockings = Material((0.02, 0.02, 0.024), 0.7, specular=0.3, role="bottom")
        bare = outfit.bottom == "shorts" or not outfit.stockings
        covering = skin if bare else stockings
        zones.append(("legs", covering))
        if outfit.bottom == "shorts" or outfit.skirt_zones == 1:
            zones.append(("upper_legs", covering))
    # Shoulders lie lower under clothes.
    under: Profile = ((0.47, 0.0), (0.49, -0.012), (0.545, -0.008), (0.575, 0.0))
    return Layer(tuple(zones), under, layout=lay_out_head, keeps=_above_clothes)


def _above_clothes(template_m: Array) -> Array:
    """All but slivers of the shoulders beyond every neckline."""
    x, y, z = template_m.T
    return np.asarray((np.hypot(x - 0.012, y) < 0.1) | (z > 0.6) | (z < 0.48))


def _eyes(person: Person) -> Layer:
    ball = Material((0.95, 0.95, 0.95), 0.12, texture="texture/eyes?seed=0", role="eyes")
    cell = partial(lay_out_eyes, cell=person.eyes)
    return Layer((("eyes", ball), ("irises", ball)), layout=cell)


_SKIN_LIFT, _FACE_LIFT = 1.13, 1.16
"""One over the mean reflectance of ``skin_relief`` and of the ground of ``face``."""
_NECK_Z_M = 0.53
"""Borders of tops above this height are necklines."""


def _lifted(color: Vec3, factor: float) -> Vec3:
    r, g, b = (min(1.0, factor * c) for c in color)
    return (r, g, b)


def _bottoms(outfit: Outfit) -> tuple[Layer, ...]:
    material = outfit.bottom_material
    if outfit.bottom == "trousers":
        zones: tuple[str, ...] = ("hips", "thighs", "shins", "ankles")
        if outfit.top == "coat":
            zones = zones[outfit.skirt_zones :]
        profile: Profile = ((-0.78, 0.024), (-0.7, 0.018), (-0.36, 0.013), (-0.1, 0.008),
                            (0.0, 0.004), (0.12, 0.002))  # fmt: skip
        painted = tuple((zone, material) for zone in zones)
        return (Layer(painted, profile, 0.0025, 5.0, smoothings=1, mapped=True),)
    if outfit.bottom == "shorts":
        profile = ((-0.31, 0.022), (-0.1, 0.01), (0.0, 0.004), (0.12, 0.002))
        painted = (("hips", material), ("thighs", material))
        return (Layer(painted, profile, 0.0025, smoothings=1, mapped=True),)
    if outfit.bottom == "skirt":
        zones = ("skirt_top", "skirt_middle", "skirt_end")[: outfit.skirt_zones]
        profile = ((0.02, 0.004), (0.12, 0.016), (0.18, 0.016))
        return (Layer(tuple((zone, material) for zone in zones), profile, 0.001, mapped=True),)
    return ()


def _tops(outfit: Outfit) -> tuple[Layer, ...]:
    tucked = outfit.bottom == "skirt" and outfit.top != "coat"
    zones = ["torso", "front", *(("sleeves",) if outfit.sleeves else ())]
    if outfit.top in ("dress", "coat"):
        zones += ("skirt_top", "skirt_middle", "skirt_end")[: outfit.skirt_zones]
    elif not tucked:
        zones.append("hips")
    thick = _THICKNESS_M[outfit.top]
    waist = 0.002 if tucked else thick + 0.006
    profile = ((-0.02, thick + 0.009), (0.14, waist), (0.22, thick), (0.48, thick),
               (0.54, 0.3 * thick))  # fmt: skip
    materials = {"front": outfit.front_material}
    painted = tuple((zone, materials.get(zone, outfit.top_material)) for zone in zones)
    return (
        Layer(
            painted, profile, 0.32 * thick, 5.0, smoothings=5, mapped=True,
            collar=_COLLARS[outfit.top],
        ),
    )  # fmt: skip


_COLLARS = {
    "tshirt": Collar(0.001, 0.14),
    "dress": Collar(0.001, 0.14),
    "shirt": Collar(0.014, 0.22),
    "jacket": Collar(0.03, 0.24),
    "coat": Collar(0.035, 0.22),
}


def _shoes(outfit: Outfit) -> Layer:
    zones = tuple((zone, outfit.shoe_material) for zone in ("ankles", "shoes", "soles"))
    bare = outfit.bottom != "trousers"
    return Layer(zones[1 if bare else 0 :], ((-0.8, 0.012), (-0.74, 0.006)), layout=lay_out_shoes)


def _smooth(places: Array, faces: Indices, border: Indices, times: int) -> Array:
    """Smooth points along their normals without shrinking (Taubin); vertices on borders stay.

    Source: Taubin, "A signal processing approach to fair surface design", SIGGRAPH 1995.
    """
    start, end = faces.T.reshape(-1), np.roll(faces, -1, axis=1).T.reshape(-1)
    counts = np.bincount(start, minlength=len(places))
    normals = vertex_normals(places, faces)
    normals[border] = 0.0
    # Column by column: rows of three numbers are slow to gather.
    columns, directions = list(places.T.copy()), normals.T.copy()
    for step in _SMOOTHING * times:
        sums = [np.bincount(start, column[end], len(column)) for column in columns]
        toward = [total / counts - column for total, column in zip(sums, columns, strict=True)]
        # Along the normal only: where triangles are uneven, seams would drift sideways.
        x, y, z = (way * part for way, part in zip(toward, directions, strict=True))
        rise = step * (x + y + z)
        columns = [c + rise * part for c, part in zip(columns, directions, strict=True)]
    return np.stack(columns, axis=1)


def _wrinkles(p: Array, phases: Array) -> Array:
    """Soft folds in [-1, 1], shape [n]: a few plane waves whose directions are a golden spiral."""
    total = np.zeros(len(p))
    for k in range(_WAVES):
        turn = 2.399963 * k
        z = 1.0 - (2.0 * k + 1.0) / _WAVES
        r = math.sqrt(1.0 - z * z)
        wave = p[:, 0] * (r * math.cos(turn)) + p[:, 1] * (r * math.sin(turn)) + p[:, 2] * z
        total += np.sin(2.0 * math.pi * wave + phases[k])
    return total / _WAVES
