"""Layers over a body: visible skin, garments and hair."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from gen_data.generator.assets.people.body import Array, BodyTemplate, Indices
from gen_data.generator.assets.people.person import Outfit, Person
from gen_data.generator.assets.people.posing import vertex_normals
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.se3 import Vec3

Profile = Sequence[tuple[float, float]]
"""(height in the template [m], distance from the body [m]), heights rising."""

_WAVES = 7
_THICKNESS_M = {"tshirt": 0.009, "shirt": 0.01, "jacket": 0.018, "coat": 0.018, "dress": 0.006}
"""How far garments stand off the chest, the air under them included."""
_SMOOTHING = (0.55, -0.57)
"""A step that smooths and shrinks, and one that takes the shrinking back."""


@dataclass(frozen=True, eq=False, slots=True)
class Layer:
    """Zones of the template that form one sheet.

    Attributes:
        zones: Each zone and its material.
        profile: How far the sheet stands off the template.
        folds_m: Height of its wrinkles.
        waves_per_m: Of the wrinkles.
        tapered: Whether the sheet's edge lies on the body (hair).
        smoothings: How often the sheet is smoothed: cloth spans hollows.
        mapped: Whether its materials have garment textures (``garment_layout``).
    """

    zones: tuple[tuple[str, Material], ...]
    profile: Profile = ((0.0, 0.0),)
    folds_m: float = 0.0
    waves_per_m: float = 6.0
    tapered: bool = False
    smoothings: int = 0
    mapped: bool = False


def layers(person: Person) -> tuple[Layer, ...]:
    """All visible layers of a person, from the skin outwards."""
    outfit = person.outfit
    return (_skin(person), *_hair(person), *_bottoms(outfit), *_tops(outfit), _shoes(outfit))


@dataclass(frozen=True, eq=False, slots=True)
class Region:
    """The part of a template that a layer covers; the same for everyone.

    Attributes:
        used: Points of the template, int64 [n].
        faces: Triangles of these points, [m, 3].
        slots: Index of each triangle's zone, [m].
        border: Those of these points that lie on a border, [k].
    """

    used: Indices
    faces: Indices
    slots: Indices
    border: Indices


def displace_layer(
    body: BodyTemplate, layer: Layer, points_m: Array, phases: Array
) -> tuple[Region, Array]:
    """One layer on a body that is not posed yet.

    Args:
        body: The template.
        layer: What to make.
        points_m: The template in the person's shape [m], shape [points, 3].
        phases: Of the wrinkles [rad], shape [7].

    Returns:
        The region that the layer covers, and the places of its points [m], shape [n, 3].
    """
    region = find_region(body, tuple(zone for zone, _ in layer.zones))
    places = points_m[region.used]
    if layer.smoothings:
        places = _smooth(places, region, layer.smoothings)
    if any(distance for _, distance in layer.profile):
        heights, distances = zip(*layer.profile, strict=True)
        template = body.points_m[region.used]
        off = np.interp(template[:, 2], heights, distances)
        if layer.folds_m:
            off += layer.folds_m * _wrinkles(template * layer.waves_per_m, phases)
        if layer.tapered:
            off[region.border] = 0.0
        places = places + off[:, None] * vertex_normals(places, region.faces)
    return region, places


@lru_cache(maxsize=256)
def find_region(body: BodyTemplate, zones: tuple[str, ...]) -> Region:
    """The part of a template in some zones; zones that it does not have stay out."""
    parts = [(k, body.faces[zone]) for k, zone in enumerate(zones) if zone in body.faces]
    faces = np.concatenate([part for _, part in parts])
    slots = np.concatenate([np.full(len(part), k, dtype=np.int64) for k, part in parts])
    used = np.zeros(len(body.points_m), dtype=bool)
    used[faces] = True
    local = (np.cumsum(used) - 1)[faces]
    return Region(np.flatnonzero(used), local, slots, _border(local))


def _skin(person: Person) -> Layer:
    outfit = person.outfit
    skin = Material(
        _lifted(person.skin, _SKIN_LIFT), 0.5, specular=0.4,
        texture="texture/skin_relief?seed=0", texture_scale_m=0.3, role="skin",
    )  # fmt: skip
    r, g, b = skin.base_color
    lips = replace(skin, base_color=(0.82 * r, 0.55 * g, 0.55 * b), roughness=0.4)
    x, y, z = ((1.0 - 0.45) * p + 0.45 * q for p, q in zip(person.hair, person.skin, strict=True))
    brows = Material(base_color=(x, y, z), roughness=0.8, role="hair")
    zones = [("face", skin), ("lips", lips), ("brows", brows), ("hands", skin)]
    if person.haircut == "bald" and not outfit.headwear:
        zones.append(("scalp", skin))
    if not outfit.sleeves:
        zones.append(("arms", skin))
    if outfit.bottom in ("shorts", "skirt", "none"):
        stockings = Material((0.02, 0.02, 0.024), 0.7, specular=0.3, role="bottom")
        bare = outfit.bottom == "shorts" or not outfit.stockings
        covering = skin if bare else stockings
        zones.append(("legs", covering))
        if outfit.bottom == "shorts" or outfit.skirt_zones == 1:
            zones.append(("upper_legs", covering))
    return Layer(tuple(zones))


def _hair(person: Person) -> tuple[Layer, ...]:
    white = Material((0.72, 0.7, 0.68), 0.15, role="eyes")
    iris = Material((0.035, 0.022, 0.014), 0.1, role="eyes")
    made = [Layer((("eyes", white), ("irises", iris)))]
    hair = Material(
        _lifted(person.hair, _HAIR_LIFT), 0.55, specular=0.5,
        texture="texture/hair_strands?seed=0", texture_scale_m=0.25, role="hair",
    )  # fmt: skip
    headwear = person.outfit.headwear
    if headwear in ("hood", "headscarf"):
        return (*made, *_hood(person.outfit))
    if person.haircut in ("bob", "long"):
        zones = ("hair", "hair_end") if person.haircut == "long" else ("hair",)
        made.append(Layer(tuple((zone, hair) for zone in zones), ((0.0, 0.001),), 0.005, 11.0))
    if headwear:
        hat = ("scalp", person.outfit.hat_material)
        profile: Profile = ((0.66, 0.008), (0.8, 0.012), (0.85, 0.022))
        made.append(Layer((hat,), profile if headwear == "beanie" else _CAP))
    elif person.haircut != "bald":
        thick = 0.006 if person.haircut == "cropped" else 0.016
        profile = ((0.66, 0.6 * thick), (0.76, 0.7 * thick), (0.84, 1.4 * thick))
        made.append(Layer((("scalp", hair),), profile, 0.22 * thick, 16.0, tapered=True))
    return tuple(made)


_CAP: Profile = ((0.66, 0.006), (0.76, 0.009), (0.83, 0.02), (0.85, 0.016))
_HAIR_LIFT = 1.75
"""One over the mean reflectance of ``hair_strands``."""


_SKIN_LIFT = 1.13
"""One over the mean reflectance of ``skin_relief``."""


def _lifted(color: Vec3, factor: float) -> Vec3:
    r, g, b = (min(1.0, factor * c) for c in color)
    return (r, g, b)


def _hood(outfit: Outfit) -> tuple[Layer, ...]:
    """A hood that is up, or a headscarf: over the head and down to the shoulders."""
    scarf = outfit.headwear == "headscarf"
    material = outfit.hat_material if scarf else replace(outfit.top_material, texture="")
    thick = 0.012 if scarf else 0.026
    profile: Profile = ((0.5, 0.018), (0.6, thick), (0.74, thick), (0.84, 1.2 * thick))
    zones = (("scalp", material), ("hair", material))
    return tuple(Layer((zone,), profile, 0.004, 9.0) for zone in zones)


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
    return (Layer(painted, profile, 0.32 * thick, 5.0, smoothings=5, mapped=True),)


def _shoes(outfit: Outfit) -> Layer:
    sole = Material((0.03, 0.03, 0.03), 0.85, role="shoes")
    zones = (("ankles", outfit.shoe_material), ("shoes", outfit.shoe_material), ("soles", sole))
    return Layer(zones[0 if outfit.bottom == "trousers" else 1 :], ((-0.8, 0.012), (-0.74, 0.006)))


def _smooth(places: Array, region: Region, times: int) -> Array:
    """Smooth points along their normals without shrinking (Taubin); vertices on borders stay.

    Source: Taubin, "A signal processing approach to fair surface design", SIGGRAPH 1995.
    """
    faces = region.faces
    start, end = faces.T.reshape(-1), np.roll(faces, -1, axis=1).T.reshape(-1)
    counts = np.bincount(start, minlength=len(places))
    normals = vertex_normals(places, faces)
    normals[region.border] = 0.0
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


def _border(faces: Indices) -> Indices:
    """Vertices on edges that only one face has."""
    start, end = faces.T.reshape(-1), np.roll(faces, -1, axis=1).T.reshape(-1)
    size = int(faces.max()) + 1
    edges, counts = np.unique(
        np.minimum(start, end) * size + np.maximum(start, end), return_counts=True
    )
    alone = edges[counts == 1]
    return np.unique(np.concatenate([alone // size, alone % size]))
