"""Procedural assets: everything here is made by a formula from a seed or from a size.

Three tables. A new generator is one function and one line; it is imported when first built.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TypeVar

from generator.assets.procedural.family import (
    EnvironmentFamily,
    Family,
    Lazy,
    Solid,
    TextureFamily,
)

__all__ = [
    "ENVIRONMENTS",
    "FAMILIES",
    "TEXTURES",
    "EnvironmentFamily",
    "Family",
    "Solid",
    "TextureFamily",
]

_F = TypeVar("_F", Family, TextureFamily, EnvironmentFamily)


def _household(
    name: str,
    category: str,
    kinds: str,
    variants: int,
    mass_kg: float,
    *,
    stackable: bool,
    build: str,
) -> Family:
    tags = tuple(sorted({"household", *kinds.split()}))
    return Family(name, category, tags, variants, mass_kg, stackable, 1, {}, Lazy(build))


def _glassware(name: str, category: str, mass_kg: float) -> Family:
    build = Lazy(f"glassware:{name}")
    tags = ("container", "glassware")
    return Family(name, category, tags, 16, mass_kg, False, 1, {}, build)


def _part(name: str, mass_kg: float, variants: int = 12, *, stackable: bool = False) -> Family:
    build = Lazy(f"parts:{name}")
    return Family(name, name, ("part",), variants, mass_kg, stackable, 1, {}, build)


def _static(name: str, build: str, **parameters: object) -> Family:
    return Family(name, name, ("furniture",), 0, 0.0, False, 1, parameters, Lazy(build))


def _texture(name: str, build: str, tags: str = "surface", variants: int = 16) -> TextureFamily:
    return TextureFamily(name, tuple(sorted(tags.split())), variants, 1, Lazy(build))


def _environment(name: str, tags: str, variants: int = 8) -> EnvironmentFamily:
    build = Lazy(f"environments:{name}")
    return EnvironmentFamily(name, tuple(sorted(tags.split())), variants, 1, build)


def _table(families: Iterable[_F]) -> Mapping[str, _F]:
    return {family.name: family for family in families}


FAMILIES: Mapping[str, Family] = _table(
    (
        _household(
            "mug", "mug", "tableware container", 32, 0.34, stackable=False, build="tableware:mug"
        ),
        _household(
            "cup", "cup", "tableware container", 24, 0.06, stackable=False, build="tableware:cup"
        ),
        _household(
            "bowl", "bowl", "tableware container", 24, 0.4, stackable=False, build="tableware:bowl"
        ),
        _household(
            "plate", "plate", "tableware", 24, 0.5, stackable=False, build="tableware:plate"
        ),
        replace(
            _household(
                "bottle",
                "bottle",
                "container printed",
                36,
                0.7,
                stackable=False,
                build="bottles:bottle",
            ),
            version=2,
        ),
        _household("can", "can", "container printed", 32, 0.36, stackable=True, build="cans:can"),
        _household(
            "carton",
            "carton",
            "container printed",
            32,
            0.35,
            stackable=True,
            build="cartons:carton",
        ),
        _household(
            "milk_carton",
            "carton",
            "container printed",
            16,
            0.8,
            stackable=False,
            build="cartons:milk_carton",
        ),
        _household(
            "jar", "jar", "container printed", 20, 0.45, stackable=True, build="bottles:jar"
        ),
        _household("book", "book", "printed", 32, 0.4, stackable=True, build="books:book"),
        _household("apple", "apple", "food", 16, 0.18, stackable=False, build="fruit:apple"),
        _household("orange", "orange", "food", 16, 0.2, stackable=False, build="fruit:orange"),
        _household("banana", "banana", "food", 16, 0.15, stackable=False, build="fruit:banana"),
        _household("lemon", "lemon", "food", 12, 0.1, stackable=False, build="fruit:lemon"),
        _household("pear", "pear", "food", 16, 0.17, stackable=False, build="fruit:pear"),
        _household("fork", "fork", "cutlery", 16, 0.045, stackable=False, build="cutlery:fork"),
        _household("knife", "knife", "cutlery", 16, 0.07, stackable=False, build="cutlery:knife"),
        _household("spoon", "spoon", "cutlery", 18, 0.05, stackable=False, build="cutlery:spoon"),
        _household(
            "screwdriver",
            "screwdriver",
            "tool",
            16,
            0.1,
            stackable=False,
            build="tools:screwdriver",
        ),
        _household("hammer", "hammer", "tool", 16, 0.55, stackable=False, build="tools:hammer"),
        _household("wrench", "wrench", "tool", 16, 0.15, stackable=False, build="tools:wrench"),
        _household("toy_block", "toy block", "toy", 24, 0.05, stackable=True, build="toys:block"),
        _household("ball", "sports ball", "toy", 20, 0.06, stackable=False, build="toys:ball"),
        _household("candle", "candle", "decoration", 16, 0.2, stackable=False, build="toys:candle"),
        _household("vase", "vase", "decoration", 16, 0.6, stackable=False, build="toys:vase"),
        _glassware("tumbler", "drinking glass", 0.25),
        _glassware("wine_glass", "wine glass", 0.15),
        _part("hex_bolt", 0.06, 20),
        _part("nut", 0.02, 15),
        _part("washer", 0.012, 15),
        _part("stepped_shaft", 0.25, 16),
        _part("pipe_elbow", 0.12, 16),
        _part("bracket", 0.05, 16),
        _part("gear", 0.12, 16),
        _part("flange", 0.2, 16),
        _part("connector", 0.09, 16),
        _static("table", "furniture:table", size_m=(1.2, 0.8, 0.74), style="legs"),
        _static("shelf", "furniture:shelf", size_m=(0.9, 0.32, 1.6), levels=4, style="bookcase"),
        _static("bin", "furniture:bin_", size_m=(0.6, 0.4, 0.22), color="blue"),
        _static("box", "furniture:box_", size_m=(0.2, 0.2, 0.2), color="grey"),
        _static("pedestal", "furniture:pedestal", size_m=(0.3, 0.3, 0.7)),
        _static("gantry", "furniture:gantry", size_m=(1.6, 1.0, 1.8)),
        _static("plane", "furniture:plane", size_m=(4.0, 4.0)),
        _static(
            "backdrop", "furniture:backdrop", size_m=(3.0, 3.0, 2.2), radius_m=0.6, color="white"
        ),
        # Lamps of all sizes are drawn, and quickly made.
        replace(
            _static(
                "light_panel",
                "furniture:light_panel",
                size_m=(0.6, 0.6),
                shape="rectangle",
                depth_m=0.04,
            ),
            stored=False,
        ),
        _static("room", "room:room", size_m=(5.0, 4.0, 2.8), door=1, window=1),
    )
)

TEXTURES: Mapping[str, TextureFamily] = _table(
    (
        _texture("wood_grain", "textures.wood:wood_grain", "surface wood", 18),
        _texture("wood_planks", "textures.wood:wood_planks", "floor planks surface wood", 18),
        _texture("marble", "textures.stone:marble", "floor stone surface"),
        _texture("terrazzo", "textures.stone:terrazzo", "floor stone surface"),
        _texture("concrete", "textures.stone:concrete", "floor stone surface wall"),
        _texture("plaster", "textures.stone:plaster", "surface wall"),
        _texture("brick", "textures.stone:brick", "stone surface wall"),
        _texture("tiles", "textures.stone:tiles", "floor stone surface wall"),
        _texture("fabric", "textures.fabric:fabric", "surface textile"),
        _texture("carpet", "textures.fabric:carpet", "floor surface textile"),
        _texture("leather", "textures.fabric:leather", "surface textile"),
        _texture("cardboard", "textures.fabric:cardboard", "surface"),
        _texture("brushed_metal", "textures.metal:brushed_metal", "metal surface"),
        _texture("painted_metal", "textures.metal:painted_metal", "metal surface"),
        _texture("checker", "textures.pattern:checker", "pattern"),
        _texture("stripes", "textures.pattern:stripes", "pattern"),
        _texture("perlin_noise", "textures.pattern:perlin_noise", "pattern"),
        _texture("voronoi_noise", "textures.pattern:voronoi_noise", "pattern"),
        _texture("apple_skin", "textures.food:apple_skin", "food"),
        _texture("citrus_peel", "textures.food:citrus_peel", "food"),
        _texture("banana_peel", "textures.food:banana_peel", "food"),
        _texture("pear_skin", "textures.food:pear_skin", "food"),
        _texture("ball_cover", "textures.ball:ball_cover", "printed", 20),
        _texture("label", "textures.printed:label", "printed", 36),
        _texture("can_label", "textures.printed:can_label", "printed", 32),
        _texture("carton", "textures.printed:carton", "printed", 32),
        _texture("milk_label", "textures.printed:milk_label", "printed"),
        _texture("book_cover", "textures.printed:book_cover", "printed", 32),
    )
)

ENVIRONMENTS: Mapping[str, EnvironmentFamily] = _table(
    (
        _environment("neutral", "studio"),
        _environment("studio", "studio", 16),
        _environment("indoor", "indoor", 16),
        _environment("overcast", "outdoor"),
        _environment("clear_sky", "outdoor", 12),
        _environment("sunset", "outdoor", 12),
        _environment("night_city", "outdoor"),
    )
)
