"""Dogs that stand, walk or sit; noses at +X.

Heights at the withers are breed standards': Labrador 55-62, German shepherd 56-66, collie 46-56,
beagle 33-38, French bulldog 28-30 cm (heightandsize.com, "Average dog height chart"); terrier and
dachshund assumed, 10 %. Proportions as shares of that height are drawn by eye.
"""

import math
from dataclasses import dataclass

import numpy as np

from gen_data.assets.family import Facts, Solid
from gen_data.config.data_files import load_table
from gen_data.content.procedural import collision_hulls as hulls
from gen_data.content.procedural.material_presets import draw_linear, painted_material
from gen_data.content.procedural.patches import Array, Patch, join_patches
from gen_data.content.procedural.surface_shapes import ball, circle, spline, sweep
from gen_data.content.scenery.basic_shapes import make_solid
from gen_data.core.asset_types import Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, variant_rng

POSES = ("standing", "walking", "sitting")
_COAT, _MARKS, _NOSE, _COLLAR = range(4)


@dataclass(frozen=True)
class _Breed:
    """Measures of a breed as shares of its height at the withers, but for that height.

    Attributes:
        withers_m: Smallest and largest height.
        length: From chest to rump.
        chest: Radius of the chest.
        leg: Radius of a forearm.
        muzzle: Length of the muzzle.
        head: Radius of the skull.
        ears: ``upright``, ``hanging`` or ``folded``.
        tail: ``low``, ``curled``, ``raised`` or ``none``.
        coats: Colours of the coat and of its markings, sRGB.
    """

    withers_m: tuple[float, float]
    length: float
    chest: float
    leg: float
    muzzle: float
    head: float
    ears: str
    tail: str
    coats: tuple[str, ...]


_BREEDS = load_table(__package__, "dogs", _Breed)
BREEDS = tuple(_BREEDS)


def dog(seed: int) -> Solid:
    """A dog; breeds and poses in turn. Slots: coat, markings, nose and eyes, collar."""
    name, pose = _kind(seed)
    breed, rng = _BREEDS[name], variant_rng("dog", seed)
    size = rng.between(*breed.withers_m, "withers_m")
    parts = _sit(breed) if pose == "sitting" else _stand(breed, pose == "walking", rng)
    body = join_patches(parts).scaled(size, size, size)
    low, high = body.bounds_m()
    body = body.moved(-0.5 * float(low[0] + high[0]), 0.0, -float(low[2]))
    coat, marks = rng.choose(breed.coats).split()
    materials = (
        Material(draw_linear((coat,), 0.1, rng), roughness=0.9, specular=0.25),
        Material(draw_linear((marks,), 0.1, rng), roughness=0.9, specular=0.25),
        painted_material("#0d0d0e", 0.35),
        painted_material(rng.choose(("#b3261e", "#22406f", "#1a1a1b", "#7a5638")), 0.6),
    )
    return make_solid([body], materials, [hulls.extreme(body.corners_m, 32)])


def dog_facts(seed: int) -> Facts:
    """Its breed and pose."""
    name, pose = _kind(seed)
    return Facts("dog", {"breed": name, "pose": pose})


def _kind(seed: int) -> tuple[str, str]:
    rng = variant_rng("dog", seed)
    return rng.turn(BREEDS, "breed"), rng.turn(POSES, "pose", seed + seed // len(BREEDS))


def _limb(path: list[Vec3], radii: list[float], slot: int = _COAT, sides: int = 10) -> Patch:
    """A tapering round limb through points."""
    rows = spline([(*p, r) for p, r in zip(path, radii, strict=True)], 2 * len(path) - 1)
    return sweep(rows[:, :3], circle(1.0, sides), up=(0.0, 1.0, 0.0), scale=rows[:, 3], slot=slot)


def _blob(at: Vec3, half: Vec3, slot: int = _COAT) -> Patch:
    made = ball(lambda d: d * np.array(half), rings=6, segments=9)
    return made.moved(*at).painted(slot)


def _trunk(points: list[Vec3], sizes: list[tuple[float, float]]) -> Patch:
    """The body along a path; sizes are half the width and half the height."""
    rows: Array = spline([(*p, *s) for p, s in zip(points, sizes, strict=True)], 9)
    return sweep(rows[:, :3], circle(1.0, 12), up=(0.0, 1.0, 0.0), scale=rows[:, 3:], slot=_COAT)


def _stand(breed: _Breed, walking: bool, rng: VariantRng) -> list[Patch]:
    """Trunk, neck, head, legs and tail of a standing dog; a walking one lifts diagonal legs."""
    half, c = 0.5 * breed.length, breed.chest
    back = 1.0 - c
    trunk = _trunk(
        [(half, 0.0, back + 0.02), (0.62 * half, 0.0, back - 0.04), (0.0, 0.0, back),
         (-0.6 * half, 0.0, back + 0.06), (-half, 0.0, back + 0.05)],
        [(0.4 * c, 0.5 * c), (0.82 * c, c), (0.8 * c, 0.88 * c), (0.66 * c, 0.7 * c),
         (0.35 * c, 0.4 * c)],
    )  # fmt: skip
    swing = 0.16 if walking else 0.03
    steps = (swing, -swing, -swing, swing)
    parts = [trunk]
    for side, step in zip((1.0, -1.0), steps[:2], strict=True):
        parts.append(_fore_leg(breed, 0.66 * half, side * 0.6 * c, step))
    for side, step in zip((1.0, -1.0), steps[2:], strict=True):
        parts.append(_hind_leg(breed, -0.72 * half, side * 0.6 * c, step))
    parts += _paws(parts[1:])
    head = (half + 0.1 + 0.5 * c, 0.0, 1.02 + 0.12 * rng.between(-1.0, 1.0))
    parts += _neck_and_head(breed, (0.75 * half, 0.0, back + 0.35 * c), head)
    parts += _tail(breed, (-half + 0.02, 0.0, back + 0.15))
    return parts


def _fore_leg(breed: _Breed, x: float, y: float, step: float) -> Patch:
    r, elbow = breed.leg, 0.52
    path = [(x, 0.5 * y, 0.7), (x - 0.05, y, elbow), (x + 0.5 * step, y, 0.24), (x + step, y, 0.03)]
    return _limb(path, [1.9 * r, 1.5 * r, r, 0.95 * r])


def _hind_leg(breed: _Breed, x: float, y: float, step: float) -> Patch:
    r = breed.leg
    path = [
        (x, 0.5 * y, 0.72),
        (x + 0.06, y, 0.45),
        (x - 0.13 + 0.5 * step, y, 0.24),
        (x - 0.06 + step, y, 0.03),
    ]
    return _limb(path, [2.7 * r, 2.0 * r, r, 0.95 * r])


def _paws(legs: list[Patch]) -> list[Patch]:
    made = []
    for leg in legs:
        points = leg.corners_m.reshape(-1, 3)
        foot = points[points[:, 2] < points[:, 2].min() + 0.04].mean(axis=0)
        at = (float(foot[0]) + 0.035, float(foot[1]), 0.035)
        made.append(_blob(at, (0.075, 0.05, 0.035), _MARKS))
    return made


def _neck_and_head(breed: _Breed, root: Vec3, head: Vec3) -> list[Patch]:
    h, (x, _, z) = breed.head, head
    middle = tuple(0.5 * (a + b) for a, b in zip(root, head, strict=True))
    neck = _limb([root, (middle[0], 0.0, middle[2]), head], [1.35 * h, 1.0 * h, 0.85 * h])
    along = np.array(head) - np.array(root)
    along /= math.sqrt(float((along**2).sum()))
    ring = np.array(middle)[None, :] + np.array([-0.02, 0.025])[:, None] * along
    collar = sweep(ring, circle(1.06 * h, 10), up=(0.0, 1.0, 0.0), slot=_COLLAR)
    tip = x + 0.7 * h + breed.muzzle
    muzzle = _limb([(x + 0.4 * h, 0.0, z - 0.25 * h), (tip - 0.3 * breed.muzzle, 0.0, z - 0.38 * h),
                    (tip, 0.0, z - 0.42 * h)], [0.62 * h, 0.48 * h, 0.38 * h], _MARKS)  # fmt: skip
    parts = [
        neck, collar, muzzle,
        _blob(head, (1.05 * h, 0.92 * h, 0.9 * h)),
        _blob((tip + 0.02, 0.0, z - 0.28 * h), (0.14 * h, 0.18 * h, 0.15 * h), _NOSE),
    ]  # fmt: skip
    for side in (1.0, -1.0):
        parts.append(_blob((x + 0.82 * h, side * 0.42 * h, z + 0.22 * h), (0.12 * h,) * 3, _NOSE))
        parts.append(_ear(breed, (x - 0.15 * h, side * 0.68 * h, z + 0.55 * h), side))
    return parts


def _ear(breed: _Breed, at: Vec3, side: float) -> Patch:
    h, (x, y, z) = breed.head, at
    if breed.ears == "upright":
        path = [(x, y, z - 0.1 * h), (x, y, z + 0.5 * h), (x + 0.02, y, z + 0.95 * h)]
        return _limb(path, [0.36 * h, 0.26 * h, 0.04 * h], _COAT, 5)
    fall = 1.25 if breed.ears == "hanging" else 0.6
    out = y + side * 0.3 * h
    path = [(x, y, z), (x + 0.1 * h, out, z - 0.3 * h), (x + 0.1 * h, out, z - fall * h)]
    return _limb(path, [0.16 * h, 0.3 * h, 0.18 * h], _COAT, 5)


def _tail(breed: _Breed, root: Vec3) -> list[Patch]:
    x, _, z = root
    # Steps from one point to the next, backwards and up.
    steps = {
        "low": ((0.14, -0.06), (0.1, -0.28), (0.06, -0.12)),
        "raised": ((0.14, 0.06), (0.12, 0.14), (0.04, 0.16)),
        "curled": ((0.08, 0.14), (-0.12, 0.12), (-0.1, -0.08)),
    }.get(breed.tail, ())
    ends = np.cumsum([(0.0, 0.0), *steps], axis=0).tolist()
    path = [(x - back, 0.0, z + up) for back, up in ends]
    if not steps:
        return []
    r = 0.5 * breed.leg
    return [_limb(path, [1.5 * r, 1.5 * r, 1.2 * r, 0.4 * r], _COAT, 6)]


def _sit(breed: _Breed) -> list[Patch]:
    """A sitting dog: upright trunk on folded hind legs."""
    c, length = breed.chest, breed.length
    hip, chest = (-0.36 * length, 0.0, 0.9 * c), (0.06, 0.0, 0.84)
    trunk = _trunk(
        [(hip[0] - 0.1, 0.0, 0.6 * c), hip, (-0.16 * length, 0.0, 0.5), (0.0, 0.0, 0.72),
         (0.12, 0.0, 0.9)],
        [(0.4 * c, 0.4 * c), (0.85 * c, 0.85 * c), (0.82 * c, 0.85 * c), (0.8 * c, 0.9 * c),
         (0.45 * c, 0.5 * c)],
    )  # fmt: skip
    parts, legs = [trunk], []
    for side in (1.0, -1.0):
        y = side * 0.6 * c
        x = 0.2
        path = [(x - 0.16, 0.5 * y, 0.76), (x - 0.07, y, 0.48), (x, y, 0.22), (x + 0.02, y, 0.03)]
        legs.append(_limb(path, [1.8 * breed.leg, 1.4 * breed.leg, breed.leg, 0.95 * breed.leg]))
        parts.append(_blob((hip[0] + 0.1, 1.25 * y, 0.75 * c), (0.2, 0.4 * c, 0.75 * c)))
        parts.append(_blob((hip[0] + 0.32, 1.3 * y, 0.04), (0.13, 0.05, 0.04), _MARKS))
    parts += [*legs, *_paws(legs)]
    parts += _neck_and_head(breed, chest, (0.2 + 0.5 * breed.head, 0.0, 1.16))
    x = hip[0] - 0.12
    tail = [(x, 0.0, 0.1), (x - 0.14, 0.03, 0.05), (x - 0.28, 0.1, 0.04)]
    r = 0.5 * breed.leg
    return [*parts, *([_limb(tail, [1.4 * r, 1.1 * r, 0.5 * r])] if breed.tail != "none" else [])]
