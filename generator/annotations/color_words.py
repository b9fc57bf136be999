"""Basic colour words of objects, from the true base colours of their surfaces.

A surface has the word of the nearest ISCC-NBS centroid in CIELAB, if that is near and clearly
nearer than any of another word; colours between basic ones, such as olive green or reddish orange,
have no word. An object has the word of nearly all of its surface.

Sources: Berlin and Kay, "Basic Color Terms", 1969 (the eleven words); Kelly and Judd, "Color:
Universal Language and Dictionary of Names", NBS Special Publication 440, 1976 (centroids: the 22 of
maximum contrast of Kelly, 1965, and further reds, pinks and brilliant colours); CIE 15:2004
(CIELAB). The limits are assumed.
"""

from collections.abc import Sequence
from functools import cache, lru_cache

import numpy as np

from gen_data.core import colorimetry, interfaces, scene, se3

CENTROIDS = {
    "white": ("F2F3F4",),
    "black": ("222222",),
    "gray": ("848482", "81878B"),
    "yellow": ("F3C300", "FADA5E"),
    "orange": ("F38400", "FD943F"),
    "red": ("BE0032", "BC3F4A", "841B2D", "5C0923", "AB4E52", "722F37"),
    "green": ("008856", "3EB489"),
    "blue": ("0067A5", "A1CAF1", "4997D0"),
    "purple": ("875692", "9A4EAE", "D399E6"),
    "pink": ("E68FAC", "FFB5BA", "EA9399", "E4717A", "F9CCCA", "DEA5A4"),
    "brown": ("654522", "882D17", "80461B"),
    "": (
        "C2B280", "F99379", "604E97", "F6A600", "B3446C", "DCD300", "8DB600", "E25822", "2B3D26",
        "00A693", "BDDA57", "E9E450", "6C79B8", "239EBA", "5B504F", "AD8884", "905D5D", "EAD8D7",
    ),
}  # fmt: skip
"""Centroids (sRGB) of each basic word; without a word, of colours between basic ones."""
FARTHEST = 40.0
"""Largest distance of a colour from the nearest one."""
CLEARLY = 0.7
"""Largest ratio of the distances from the nearest one and from the nearest of another word."""
SURFACE = 0.85
"""Smallest share of an object's surface that has its word."""
CLEAR_MAX = 0.1
"""Metals and transmitting surfaces have the colour of something else above this share."""


@lru_cache(maxsize=4096)
def color_word(rgb: se3.Vec3) -> str:
    """Basic word for a surface of a linear RGB reflectance; empty if none is beyond doubt."""
    words, centroids = _centroids()
    apart = np.sqrt(((centroids - cielab(np.array(rgb))) ** 2).sum(axis=1))
    nearest = int(apart.argmin())
    word = words[nearest]
    others = min(d for d, other in zip(apart.tolist(), words, strict=True) if other != word)
    clear = apart[nearest] <= min(FARTHEST, CLEARLY * others)
    return word if clear else ""


def cielab(rgb: se3.Array) -> se3.Array:
    """L*, a* and b* of linear RGB [..., 3] under its white, D65 (CIE 15:2004, 8.2.1)."""
    white = colorimetry.XYZ_FROM_REC709.sum(axis=1)
    ratio = np.einsum("ij,...j->...i", colorimetry.XYZ_FROM_REC709, rgb, optimize=False) / white
    edge = 6.0 / 29.0
    x, y, z = np.moveaxis(
        np.where(ratio > edge**3, np.cbrt(ratio), ratio / (3.0 * edge**2) + 4.0 / 29.0), -1, 0
    )
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1)


def color_of(bodies: Sequence[scene.Body], assets: interfaces.AssetLibrary) -> str:
    """Word of nearly all of the surface of some bodies; empty if there is none."""
    areas: dict[str, float] = {}
    for body in bodies:
        materials = body.materials or assets.materials(body.asset)
        if not materials:
            return ""
        # Slots beyond the last used one have no surface.
        for material, area_m2 in zip(materials, _slot_areas(body.asset, assets), strict=False):
            plain = max(material.metallic, material.transmission) <= CLEAR_MAX
            shows = plain and not material.texture and not any(material.emission_cd_m2)
            word = color_word(material.base_color) if shows else ""
            areas[word] = areas.get(word, 0.0) + area_m2 * body.scale**2
    main = max(areas, key=lambda word: areas[word], default="")
    return main if main and areas[main] >= SURFACE * sum(areas.values()) else ""


@lru_cache(maxsize=512)
def _slot_areas(asset: str, assets: interfaces.AssetLibrary) -> tuple[float, ...]:
    """Surface [m^2] of every material slot of an asset."""
    mesh = assets.mesh(asset)
    corners = mesh.vertices_m.astype(np.float64)[mesh.faces]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.sqrt((sides * sides).sum(axis=1))
    return tuple(np.bincount(mesh.face_slots, area).tolist())


@cache
def _centroids() -> tuple[tuple[str, ...], se3.Array]:
    """Words, and CIELAB [n, 3]."""
    listed = [(word, code) for word, codes in CENTROIDS.items() for code in codes]
    encoded = np.array([[int(c[k : k + 2], 16) / 255.0 for k in (0, 2, 4)] for _, c in listed])
    return tuple(word for word, _ in listed), cielab(colorimetry.srgb_decode(encoded))
