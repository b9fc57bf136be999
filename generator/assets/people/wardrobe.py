"""Outfits: garments, colours and patterns as seen in streets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gen_data.generator.assets.procedural.data_tables import load_table
from gen_data.generator.assets.procedural.material_presets import draw_linear
from gen_data.generator.assets.procedural.variant_rng import VariantRng
from gen_data.generator.core.asset_types import Material
from gen_data.generator.core.se3 import Vec3

_COLORS = load_table(__package__, "wardrobe", tuple[str, ...])
_WARM_FABRICS = tuple(f"texture/fabric?seed={k}" for k in (2, 5, 9))
_STRIPES = tuple(f"texture/stripes?seed={k}" for k in (3, 6))
"""Few textures, shared by all people: each texture in an image has to be uploaded."""


@dataclass(frozen=True, slots=True)
class Outfit:
    """Outfit of one person.

    Attributes:
        top: ``tshirt``, ``shirt``, ``jacket``, ``coat`` or ``dress``.
        bottom: ``trousers``, ``shorts``, ``skirt`` or, under a dress, ``none``.
        skirt_zones: How many of the skirt's three zones skirt, dress or coat reach down to.
        bag: ``""``, ``backpack`` or ``handbag``.
        front_material: Of the chest, where an open jacket shows a shirt.
        hat: Whether a knitted hat is worn.
        stockings: Whether legs that show are covered.
    """

    top: str
    bottom: str
    skirt_zones: int
    sleeves: bool
    bag: str
    hat: bool
    stockings: bool
    top_material: Material
    front_material: Material
    bottom_material: Material
    shoe_material: Material
    bag_material: Material
    hat_material: Material


def draw_outfit(sex: str, child: bool, rng: VariantRng) -> Outfit:
    """Draw an outfit that fits sex and age."""
    woman = sex == "female"
    tops = ("jacket",) * 5 + ("shirt",) * 4 + ("tshirt",) * 3 + ("coat",) * (0 if child else 3)
    top = rng.choose(tops + ("dress",) * (2 if woman else 0))
    bottoms = ("trousers",) * 9 + ("shorts",) * (2 if top in ("tshirt", "shirt") else 0)
    bottom = rng.choose(bottoms + ("skirt",) * (3 if woman else 0))
    if top == "dress":
        bottom = "none"
    outer = _top(top, child, rng)
    open_front = top in ("jacket", "coat") and rng.chance(0.6)
    reach = rng.choose((1, 1, 1, 2, 2, 2, 3))
    return Outfit(
        top=top,
        bottom=bottom,
        skirt_zones=min(reach, 2) if top == "coat" else reach,
        sleeves=top in ("shirt", "jacket", "coat") or (top == "dress" and rng.chance(0.4)),
        bag=rng.choose(("", "", "", "backpack", "handbag" if woman and not child else "")),
        hat=top in ("jacket", "coat") and rng.chance(0.2),
        stockings=top == "coat" or rng.chance(0.5),
        top_material=outer,
        front_material=_top("shirt", child, rng) if open_front else outer,
        bottom_material=_bottom(bottom, rng),
        shoe_material=_plain_material(_COLORS["shoes"], rng.between(0.35, 0.7), "shoes", rng),
        bag_material=_plain_material(_COLORS["bags"], rng.between(0.45, 0.8), "bag", rng),
        hat_material=_plain_material(_COLORS["hats"], 0.95, "hat", rng),
    )


def _top(kind: str, child: bool, rng: VariantRng) -> Material:
    if kind in ("jacket", "coat"):
        colors = _COLORS["bright"] if rng.chance(0.35 if child else 0.07) else _COLORS["jackets"]
        return _plain_material(colors, rng.between(0.55, 0.9), "top", rng)
    pattern, seed = float(rng.random()), float(rng.random())
    if kind != "tshirt" and pattern < 0.12:
        return _patterned_material(_WARM_FABRICS[int(seed * len(_WARM_FABRICS))], 0.22, "top")
    if pattern < 0.12:
        return _patterned_material(_STRIPES[int(seed * len(_STRIPES))], 0.3, "top")
    colors = _COLORS["bright"] if rng.chance(0.4 if child else 0.1) else _COLORS["tops"]
    return _plain_material(colors, rng.between(0.75, 0.95), "top", rng)


def _bottom(kind: str, rng: VariantRng) -> Material:
    colors = "skirts" if kind == "skirt" else "denim" if rng.chance(0.42) else "trousers"
    return _plain_material(_COLORS[colors], rng.between(0.75, 0.95), "bottom", rng)


def _plain_material(
    colors: Sequence[str], roughness: float, role: str, rng: VariantRng
) -> Material:
    color: Vec3 = draw_linear(colors, 0.12, rng)
    return Material(base_color=color, roughness=roughness, specular=0.35, role=role)


def _patterned_material(texture: str, scale_m: float, role: str) -> Material:
    return Material(
        base_color=(0.9, 0.9, 0.9),
        roughness=0.9,
        specular=0.35,
        texture=texture,
        texture_scale_m=scale_m,
        role=role,
    )
