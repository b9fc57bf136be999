"""Properties of a person and their outfit, drawn from a seed before any mesh is built."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from typing import Literal

from gen_data.assets.family import Facts
from gen_data.config.data_files import load_table
from gen_data.content.people.posing import BEHAVIOURS, PHASES, POSES, SHARES
from gen_data.content.procedural.material_presets import draw_linear
from gen_data.content.procedural.skin import TONES, skin_color
from gen_data.core.asset_types import Material
from gen_data.core.errors import did_you_mean
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, variant_rng

_COLORS = load_table(__package__, "wardrobe", tuple[str, ...])
_LIGHT, _DARK = 3, 6
"""Tones below the first are light, from the second on dark. All ten tones are drawn alike often, so
that none is rare in training; with which features and hair they go is assumed."""


@dataclass(frozen=True, slots=True)
class FaceKind:
    """A row of ``faces.yaml``. All but the shares are strengths.

    Attributes:
        brows: How much darker brows are than skin.
        lips: How much darker lips are than skin.
        lashes: Darkness of the line of lashes.
        beard: Stubble up to about 0.4, above that a full beard.
        age: Folds and lines.
        freckles: Freckles across cheeks and nose.
        sexes: ``female``, ``male`` or both.
        ages: Age groups that have such faces.
        share: How often it is drawn.
    """

    brows: float
    lips: float
    lashes: float
    beard: float
    age: float
    freckles: float
    sexes: tuple[str, ...]
    ages: tuple[str, ...]
    share: float


_FACES = load_table(__package__, "faces", FaceKind)


@dataclass(frozen=True, slots=True)
class Outfit:
    """Outfit of one person.

    Attributes:
        top: ``tshirt``, ``shirt``, ``jacket``, ``coat`` or ``dress``.
        bottom: ``trousers``, ``shorts``, ``skirt`` or, under a dress, ``none``.
        skirt_zones: Number of the skirt's three zones that the skirt, dress or coat covers, from
            the top.
        bag: ``""``, ``backpack``, ``handbag``, ``shoulder_bag``, ``shopping`` (a carrier bag in one
            hand) or ``shopping_both``.
        front_material: Material of the chest, where an open jacket shows a shirt.
        headwear: ``""``, ``beanie``, ``cap``, ``hood`` or ``headscarf``.
        stockings: Whether bare legs are covered.
    """

    top: str
    bottom: str
    skirt_zones: int
    sleeves: bool
    bag: str
    headwear: str
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
    bottom = rng.choose(bottoms + ("skirt",) * (2 if woman else 0))
    if top == "dress":
        bottom = "none"
    outer = draw_top_material(top, child, rng)
    open_front = top in ("jacket", "coat") and rng.chance(0.45)
    reach = rng.choose((1, 1, 1, 2, 2, 2, 3))
    return Outfit(
        top=top,
        bottom=bottom,
        skirt_zones=min(reach, 2) if top == "coat" else reach,
        sleeves=top in ("shirt", "jacket", "coat") or (top == "dress" and rng.chance(0.4)),
        bag=_drawn_bag(woman, child, rng),
        headwear=_drawn_headwear(top, woman, child, rng),
        stockings=top == "coat" or rng.chance(0.5),
        top_material=outer,
        front_material=draw_top_material("shirt", child, rng) if open_front else outer,
        bottom_material=draw_bottom_material(bottom, rng),
        shoe_material=_draw_shoes(rng),
        bag_material=_plain_material(_COLORS["bags"], rng.between(0.45, 0.8), "bag", rng),
        hat_material=_plain_material(_COLORS["hats"], 0.95, "hat", rng),
    )


def _draw_shoes(rng: VariantRng) -> Material:
    """Draw shoes; their textures have all colours."""
    return Material(
        (1.0, 1.0, 1.0), rng.between(0.35, 0.7), specular=0.35,
        texture=f"texture/shoe?seed={int(rng.random() * _SHOES)}", role="shoes",
    )  # fmt: skip


_SHOES = 12
"""Variants of ``texture/shoe``."""


# Shares of bags and headwear among people in streets: assumed, +/- half of each.
def _drawn_bag(woman: bool, child: bool, rng: VariantRng) -> str:
    bags: tuple[str, ...] = ("",) * 9 + ("backpack",) * 4
    if not child:
        bags += ("handbag", "shoulder_bag", "shoulder_bag") if woman else ("shoulder_bag",)
        bags += ("shopping", "shopping_both", "shoulder_bag" if woman else "")
    return rng.choose(bags)


def _drawn_headwear(top: str, woman: bool, child: bool, rng: VariantRng) -> str:
    warm = top in ("jacket", "coat")
    kinds: tuple[str, ...] = ("beanie", "beanie", "hood") if warm else ("cap", "cap", "")
    if warm and not woman:
        kinds += ("cap",)
    if woman and not child:
        kinds += ("headscarf",)
    return rng.choose(kinds) if rng.chance(0.28) else ""


def draw_top_material(kind: str, child: bool, rng: VariantRng) -> Material:
    """Draw the cloth of a top: mostly plain, dark and muted, some striped, checked or printed."""
    pattern, seed = float(rng.random()), int(16 * rng.random())
    if kind in ("jacket", "coat"):
        if pattern < 0.02:
            return _patterned("hi_vis", seed % 2)
        colors = _COLORS["bright"] if rng.chance(0.3 if child else 0.06) else _COLORS["jackets"]
        texture = f"quilted?seed={seed % 2}" if pattern < 0.3 else f"jacket_cloth?seed={seed % 3}"
        return _woven(texture, colors, rng.between(0.5, 0.9), "top", rng)
    if pattern < (0.3 if kind == "tshirt" else 0.1):
        return _patterned("printed_jersey", seed % 8)
    if pattern < 0.4:
        name, count = rng.choose(_PATTERNS["dress" if kind == "dress" else "shirt"])
        return _patterned(name, seed % count)
    colors = _COLORS["bright"] if rng.chance(0.3 if child else 0.08) else _COLORS["tops"]
    return _woven(f"jersey?seed={seed % 3}", colors, rng.between(0.75, 0.95), "top", rng)


_PATTERNS = {
    "shirt": (("striped_jersey", 4), ("checked_shirt", 4), ("checked_shirt", 4)),
    "dress": (("patterned_cloth", 3), ("patterned_cloth", 3), ("striped_jersey", 4)),
}


def draw_bottom_material(kind: str, rng: VariantRng) -> Material:
    """Draw the cloth of trousers or a skirt."""
    jeans, seed = kind != "skirt" and rng.chance(0.42), int(4 * rng.random())
    colors = _COLORS["skirts" if kind == "skirt" else "denim" if jeans else "trousers"]
    name = "skirt_cloth" if kind == "skirt" else "denim" if jeans else "trouser_cloth"
    texture = f"{name}?seed={seed % 2 if kind == 'skirt' else seed}"
    return _woven(texture, colors, rng.between(0.75, 0.95), "bottom", rng)


def _plain_material(
    colors: Sequence[str], roughness: float, role: str, rng: VariantRng
) -> Material:
    return Material(draw_linear(colors, 0.12, rng), roughness, specular=0.35, role=role)


def _woven(
    texture: str, colors: Sequence[str], roughness: float, role: str, rng: VariantRng
) -> Material:
    """Cloth of one colour; its texture has folds and seams only."""
    plain = _plain_material(colors, roughness, role, rng)
    # The texture is light grey: it must not darken the colour.
    lift = _DENIM_LIFT if texture.startswith("denim") else _CLOTH_LIFT
    r, g, b = (min(1.0, lift * c) for c in plain.base_color)
    return replace(plain, base_color=(r, g, b), texture=f"texture/{texture}")


_CLOTH_LIFT, _DENIM_LIFT = 1.3, 3.2
"""One over the mean reflectance of plain textures and of denim's."""


def _patterned(name: str, seed: int) -> Material:
    """Cloth whose texture has its own colours."""
    return Material(
        (1.0, 1.0, 1.0), 0.85, specular=0.35, texture=f"texture/{name}?seed={seed}", role="top"
    )


Sex = Literal["female", "male"]
AgeGroup = Literal["child", "adult", "senior"]

# Shares of the ages up to 14 and from 65 in the European Union: Eurostat, "Population structure and
# ageing", 1 January 2024: 14.6 % and 21.6 %. Of the children a third is assumed to be carried,
# pushed or indoors.
_CHILD_SHARE, _SENIOR_SHARE = 0.1, 0.216
# Mean and standard deviation [m] of adults: Fryar, Carroll, Gu, Afful and Ogden, "Anthropometric
# reference data for children and adults: United States, 2015-2018", NCHS 2021, tables 9 to 12.
_HEIGHT_M = {"female": (1.613, 0.07), "male": (1.753, 0.075)}
_SHRUNK_M = 0.03
_ADULT_M = (1.45, 2.0)
# Median from 5 to 12 years: de Onis et al., "Development of a WHO growth reference for school-aged
# children and adolescents", Bulletin of the WHO 85(9), 2007.
_CHILD_M = (1.1, 1.5)

# Assumed, +/- half of each. Children have the first three.
_HAIRCUTS = {
    "female": ("long", "ponytail", "bob", "long", "bob", "bun", "ponytail", "short", "fringe",
               "long", "curly"),
    "male": ("short", "fringe", "short", "side_part", "cropped", "cropped", "short", "side_part",
             "curly", "bald"),
}  # fmt: skip
_HORSESHOE_SHARE, _AFRO_SHARE = 0.4, 0.3
"""Of men over 65 whose crown is bald; of short or cropped hair on dark skin."""


@dataclass(frozen=True, slots=True)
class Person:
    """Appearance and activity of one person.

    Attributes:
        figure: Strength of each word of the body's shapes.
        face: Row of ``faces.yaml``.
        eyes: Row of ``eye_colors.yaml``.
        haircut: ``bald``, ``cropped``, ``short``, ``side_part``, ``fringe``, ``curly``, ``afro``,
            ``horseshoe`` (a bald crown), ``bob``, ``long``, ``ponytail`` or ``bun``.
        step: Sixteenth of the stride of the left leg.
    """

    seed: int
    sex: Sex
    age_group: AgeGroup
    height_m: float
    figure: Mapping[str, float]
    skin: Vec3
    hair: Vec3
    haircut: str
    face: int
    eyes: int
    outfit: Outfit
    pose: str
    step: int


@lru_cache(maxsize=256)
def draw_person(seed: int, pose: str = "", phase: float = -1.0) -> Person:
    """The person of a seed.

    Args:
        seed: Seed of all properties that are not given.
        pose: One of ``POSES``; empty = drawn.
        phase: Stride phase in [0, 1), rounded to sixteenths; negative = drawn.

    Raises:
        ValueError: if the pose does not exist or the phase is not finite.
    """
    if pose and pose not in POSES:
        raise ValueError(f"pose '{pose}' is none of {', '.join(POSES)}{did_you_mean(pose, POSES)}")
    rng = variant_rng("person", seed)
    sex: Sex = "female" if rng.chance(0.5) else "male"
    age_group = _drawn_age(rng)
    height_m = _drawn_height_m(sex, age_group, rng)
    tone = rng.choose(range(TONES))
    figure = _drawn_figure(sex, age_group, height_m, tone, rng)
    face_rng = variant_rng("person/face", seed)
    figure |= _drawn_features(age_group, face_rng)
    action, step = _drawn_action(seed, age_group, pose, phase)
    return Person(
        seed,
        sex,
        age_group,
        height_m,
        figure,
        skin=skin_color(tone, rng),
        hair=_drawn_hair(age_group, tone, rng),
        haircut=_drawn_haircut(sex, age_group, tone, rng, face_rng),
        face=_drawn_face(sex, age_group, face_rng),
        eyes=_drawn_eyes(tone, face_rng),
        outfit=draw_outfit(sex, age_group == "child", rng),
        pose=action,
        step=step,
    )


def facts(seed: int, pose: str, phase: float) -> Facts:
    """Facts about the person of a seed, for labels."""
    person = draw_person(seed, pose, phase)
    attributes = {
        "sex": person.sex,
        "age_group": person.age_group,
        "pose": person.pose,
        "behaviour": BEHAVIOURS[person.pose],
        "height_m": f"{person.height_m:.2f}",
    }
    return Facts("child" if person.age_group == "child" else "adult", attributes)


def _drawn_age(rng: VariantRng) -> AgeGroup:
    draw = float(rng.random())
    if draw < _CHILD_SHARE:
        return "child"
    return "senior" if draw < _CHILD_SHARE + _SENIOR_SHARE else "adult"


def _drawn_height_m(sex: Sex, age_group: AgeGroup, rng: VariantRng) -> float:
    """A height [m], whole centimetres."""
    if age_group == "child":
        return round(rng.between(*_CHILD_M), 2)
    mean, deviation = _HEIGHT_M[sex]
    # The elderly of NCHS 2021 are 3 to 4 cm shorter than the mean of all adults.
    mean -= _SHRUNK_M if age_group == "senior" else -_SHRUNK_M * _SENIOR_SHARE
    # Irwin and Hall: twelve uniforms add up to nearly a normal, exactly alike everywhere.
    normal = sum(float(rng.random()) for _ in range(12)) - 6.0
    return round(min(max(mean + deviation * normal, _ADULT_M[0]), _ADULT_M[1]), 2)


def _drawn_figure(
    sex: Sex, age_group: AgeGroup, height_m: float, tone: int, rng: VariantRng
) -> dict[str, float]:
    """Strength of every word that names of shapes use."""
    figure = {"universal": 1.0, sex: 1.0}
    grown = 0.0
    if age_group == "child":
        grown = 0.75 * max(0.0, (height_m - 1.3) / (_CHILD_M[1] - 1.3))
        figure |= {"child": 1.0 - grown, "young": grown}
    else:
        old = rng.between(0.55, 1.0) if age_group == "senior" else rng.between(0.0, 0.35)
        figure |= {"old": old, "young": 1.0 - old}
    figure |= _three("muscle", rng.between(-0.5, 0.6 if sex == "male" else 0.2))
    figure |= _three("weight", rng.between(-0.7, 0.95) if age_group != "child" else -0.1)
    if age_group != "child":
        mean, _ = _HEIGHT_M[sex]
        tall = max(-0.6, min(0.6, (height_m - mean) / 0.3))
        figure |= {"maxheight": max(0.0, tall), "minheight": max(0.0, -tall)}
    main = ("caucasian", "asian", "african")[0 if tone < _LIGHT else 1 if tone < _DARK else 2]
    other = rng.choose(("caucasian", "asian", "african"))
    share = rng.between(0.0, 0.4)
    figure[main] = 1.0 - share
    figure[other] = figure.get(other, 0.0) + share
    return figure


def _three(word: str, value: float) -> dict[str, float]:
    """Strengths of least, average and most for a value in [-1, 1]."""
    return {
        f"min{word}": max(0.0, -value),
        f"average{word}": 1.0 - abs(value),
        f"max{word}": max(0.0, value),
    }


def _drawn_hair(age_group: AgeGroup, tone: int, rng: VariantRng) -> Vec3:
    if age_group == "senior" and rng.chance(0.8):
        return draw_linear(_COLORS["grey_hair"], 0.1, rng)
    # Fair hair belongs to fair skin.
    return draw_linear(
        _COLORS["hair"][: 8 if tone < _LIGHT else 4 if tone < _DARK else 2], 0.12, rng
    )


def _drawn_haircut(
    sex: Sex, age_group: AgeGroup, tone: int, rng: VariantRng, face_rng: VariantRng
) -> str:
    haircut = rng.choose(_HAIRCUTS[sex][: 3 if age_group == "child" else None])
    draw = float(face_rng.random())
    if sex == "male" and age_group == "senior" and draw < _HORSESHOE_SHARE:
        return "horseshoe"
    short = haircut in ("short", "cropped", "curly", "fringe", "side_part")
    if short and tone >= _DARK:
        return "afro" if draw < _AFRO_SHARE else "cropped"
    return haircut


def _drawn_face(sex: Sex, age_group: AgeGroup, rng: VariantRng) -> int:
    """A row of ``faces.yaml`` that fits sex and age."""
    lots = [
        k
        for k, kind in enumerate(_FACES.values())
        if sex in kind.sexes and age_group in kind.ages
        for _ in range(round(kind.share))
    ]
    return rng.choose(lots)


def _drawn_eyes(tone: int, rng: VariantRng) -> int:
    """A row of ``eye_colors.yaml``: light eyes belong to light skin."""
    return rng.choose((0, 1, 1, 2, 3, 4, 5, 6, 6, 7) if tone < _LIGHT else (0, 0, 1, 1, 2))


def _drawn_features(age_group: AgeGroup, rng: VariantRng) -> dict[str, float]:
    """Strengths of shapes of the face and its expression; bodies without them ignore these."""
    head = rng.choose(("round_head", "oval_head", "square_head", "triangular_head"))
    nose = rng.choose(("wide_nose", "narrow_nose", "hooked_nose"))
    chin = rng.choose(("strong_chin", "weak_chin"))
    features = {
        head: rng.between(0.0, 0.7),
        nose: rng.between(0.0, 0.7),
        chin: rng.between(0.0, 0.6),
        "full_face": rng.between(0.0, 0.5),
        "squint": rng.between(0.0, 0.2),
        # The template's mouth looks sullen.
        "smile": rng.between(0.1, 0.25),
    }
    if age_group == "senior":
        features["aged_head"] = rng.between(0.4, 0.9)
    # People in streets mostly look straight ahead; expressions are assumed.
    mood = rng.choose(("smile", "smile", "frown", "raised_brows", ""))
    if mood:
        features[mood] = rng.between(0.1, 0.3 if mood == "frown" else 0.55)
    return features


_NOT_OF_AGE: Mapping[AgeGroup, tuple[str, ...]] = {
    "child": ("walk_stooped", "stand_stooped", "push_pram", "stand_pram", "carry_box", "walk_cup",
              "stand_cup", "pull_suitcase", "stand_suitcase"),
    "adult": ("walk_stooped", "stand_stooped"),
    "senior": ("run", "jog", "hurry", "crouch", "push_pram", "stand_pram"),
}  # fmt: skip
_CHILD_RUNS = 6
"""How many times more often children run than adults; assumed."""


def _drawn_action(seed: int, age_group: AgeGroup, pose: str, phase: float) -> tuple[str, int]:
    """Pose and step, drawn from a separate stream: any pose suits the same person."""
    rng = variant_rng("person/pose", seed)
    drawn = rng.choose(_pose_lots(age_group))
    step = rng.choose(range(PHASES))
    if not math.isfinite(phase):
        raise ValueError("phase is not a number")
    if phase >= 0.0:
        step = round(phase * PHASES) % PHASES
    return pose or drawn, step


@cache
def _pose_lots(age_group: AgeGroup) -> tuple[str, ...]:
    """Poses that an age takes, each as often as it is drawn."""
    runs = {"run": _CHILD_RUNS, "jog": _CHILD_RUNS} if age_group == "child" else {}
    return tuple(
        name
        for name in POSES
        if name not in _NOT_OF_AGE[age_group]
        for _ in range(round(SHARES[name]) * runs.get(name, 1))
    )
