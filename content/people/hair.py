"""Layers of hair: shells over the scalp, long hair, locks along the hairline."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from gen_data.content.people import body, edges, head_layout
from gen_data.content.people.layer import Layer, Profile
from gen_data.content.people.person import Outfit, Person
from gen_data.core import asset_types, se3

_LIFT = 1.75
"""One over the mean reflectance of ``hair_strands``."""


@dataclass(frozen=True, slots=True)
class _Cut:
    """Hair on the scalp.

    Attributes:
        thick_m: Thickness at the top; the sides have less.
        folds_m, waves_per_m: Depth and frequency of its locks.
        fringe_m, sides_m, nape_m: Lengths of locks on the forehead, before the ears, behind.
        side_part: Whether the hair is parted at the left.
        fade: Share of the thickness at the sides.
    """

    thick_m: float
    folds_m: float
    waves_per_m: float
    fringe_m: float = 0.012
    sides_m: float = 0.009
    nape_m: float = 0.008
    side_part: bool = False
    fade: float = 0.7


_CUTS: Mapping[str, _Cut] = {
    "cropped": _Cut(0.005, 0.001, 20.0, 0.006, 0.006, 0.005, fade=0.4),
    "short": _Cut(0.018, 0.004, 16.0, 0.022, 0.014, 0.012, fade=0.5),
    "side_part": _Cut(0.022, 0.0035, 14.0, 0.012, 0.013, 0.01, side_part=True, fade=0.5),
    "fringe": _Cut(0.018, 0.004, 14.0, 0.034, 0.016, 0.012),
    "curly": _Cut(0.034, 0.011, 30.0, 0.016, 0.016, 0.016, fade=0.8),
    "afro": _Cut(0.038, 0.007, 36.0, 0.016, 0.02, 0.02, fade=0.9),
    "horseshoe": _Cut(0.009, 0.002, 16.0, 0.008, 0.01, 0.01, fade=1.0),
    "bob": _Cut(0.015, 0.004, 12.0, 0.022, 0.02, 0.0),
    "long": _Cut(0.013, 0.004, 11.0, 0.012, 0.02, 0.0, side_part=True),
    "ponytail": _Cut(0.008, 0.0015, 14.0, 0.005, 0.009, 0.006),
    "bun": _Cut(0.008, 0.0015, 14.0, 0.005, 0.009, 0.006),
}
_HORSESHOE_Z_M = 0.775
_CAP: Profile = ((0.66, 0.006), (0.76, 0.009), (0.83, 0.02), (0.85, 0.016))
_BEANIE: Profile = ((0.66, 0.008), (0.8, 0.012), (0.85, 0.022))


def hair_material(person: Person) -> asset_types.Material:
    """Hair of a person, for sheets with coordinates of ``lay_out_hair``."""
    r, g, b = person.hair
    color: se3.Vec3 = (min(1.0, _LIFT * r), min(1.0, _LIFT * g), min(1.0, _LIFT * b))
    curly = person.haircut in ("curly", "afro")
    texture = f"texture/hair_strands?seed={1 if curly else 0}"
    return asset_types.Material(color, 0.5, specular=0.6, texture=texture, role="hair")


def hair_layers(person: Person) -> tuple[Layer, ...]:
    """Hair and headwear."""
    headwear, hair = person.outfit.headwear, hair_material(person)
    if headwear in ("hood", "headscarf"):
        return _hood(person.outfit)
    made = []
    if person.haircut in ("bob", "long"):
        zones = ("hair", "hair_end") if person.haircut == "long" else ("hair",)
        end_m = 0.45 if person.haircut == "long" else 0.585
        made.append(
            Layer(
                tuple((zone, hair) for zone in zones), ((0.0, 0.001),), 0.006, 11.0,
                layout=head_layout.lay_out_hair, tufts=_hanging_ends(end_m),
            )
        )  # fmt: skip
    if headwear:
        hat = ("scalp", person.outfit.hat_material)
        made.append(Layer((hat,), _BEANIE if headwear == "beanie" else _CAP))
    elif person.haircut != "bald":
        made.append(_shell(person.haircut, hair))
    return tuple(made)


def _shell(haircut: str, hair: asset_types.Material) -> Layer:
    cut = _CUTS[haircut]
    low = cut.fade * cut.thick_m
    profile: Profile = ((0.66, 0.8 * low), (0.76, low), (0.83, cut.thick_m), (0.85, cut.thick_m))
    shell = Layer(
        (("scalp", hair),), profile, cut.folds_m, cut.waves_per_m, tapered=True,
        layout=head_layout.lay_out_hair, tufts=_hairline_locks(cut),
    )  # fmt: skip
    if cut.side_part:
        shell = replace(shell, relief=_parting)
    if haircut == "horseshoe":
        shell = replace(shell, keeps=_below_the_crown)
    return shell


def _parting(template_m: body.Array) -> body.Array:
    """Share of the thickness that a parting leaves at positions in the template frame."""
    x, y, z = template_m.T
    groove = np.exp(-(((y - 0.032) / 0.009) ** 2)) * ((z > 0.78) & (x > -0.02))
    return np.asarray(1.0 - 0.85 * groove + 0.25 * np.exp(-(((y - 0.005) / 0.03) ** 2)) * (z > 0.8))


def _below_the_crown(template_m: body.Array) -> body.Array:
    """Where a bald crown leaves hair."""
    return np.asarray(template_m[:, 2] < _HORSESHOE_Z_M + 0.25 * np.minimum(0.0, -template_m[:, 0]))


def _hairline_locks(cut: _Cut) -> edges.Tufts:
    def length_m(p: body.Array) -> body.Array:
        front = (p[:, 0] > 0.08) & (p[:, 2] > 0.755)
        behind = p[:, 0] < 0.01
        return np.where(front, cut.fringe_m, np.where(behind, cut.nape_m, cut.sides_m))

    return edges.Tufts(length_m, lift_m=0.002 + 0.1 * cut.thick_m)


def _hanging_ends(end_m: float) -> edges.Tufts:
    """Uneven ends of long hair, and single locks before the ears."""

    def length_m(p: body.Array) -> body.Array:
        ends = p[:, 2] < end_m
        return np.where(ends, 0.035, np.where(p[:, 2] < 0.74, 0.012, 0.0))

    return edges.Tufts(length_m, lift_m=0.001, spread=0.35, down=0.6)


def _hood(outfit: Outfit) -> tuple[Layer, ...]:
    """A hood that is up, or a headscarf: over the head and down to the shoulders."""
    scarf = outfit.headwear == "headscarf"
    material = outfit.hat_material if scarf else replace(outfit.top_material, texture="")
    thick = 0.012 if scarf else 0.026
    profile: Profile = ((0.5, 0.018), (0.6, thick), (0.74, thick), (0.84, 1.2 * thick))
    zones = (("scalp", material), ("hair", material))
    return tuple(Layer((zone,), profile, 0.004, 9.0) for zone in zones)
