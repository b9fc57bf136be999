"""Hands with forearms that rest on tables, point, or hold objects.

The forearm runs towards -X. Grasping hands have their thumb above, and the held object is upright;
the others have their palm below.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gen_data.assets.family import Facts, Solid, choose_option
from gen_data.content.procedural import food_shapes, hand_shape
from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.hand_shape import ARM_M, Bones
from gen_data.content.procedural.material_presets import hex_to_linear, jitter_color
from gen_data.content.procedural.patches import (
    Array,
    Indices,
    Patch,
    join_patches,
    make_centred_solid,
    rotate,
    unit,
)
from gen_data.content.procedural.skin import SKIN, skin_color
from gen_data.core.asset_types import Keypoint, Material
from gen_data.core.se3 import Vec3
from gen_data.core.variant_rng import VariantRng, in_turn, variant_rng

GRASP = "grasp"
HOLD = "hold"
"""Closed on an object, by ``bends_deg``; its axes are the axes of the hand frame."""
OPEN = "open"
"""Flat with the palm up, to receive something; the forearm's end is lower than the hand."""
POSE_NAMES = ("relaxed", "flat", GRASP, "point", "pinch", "fist")
RADII_M = (0.015, 0.046)
"""Smallest and largest radius that a hand holds."""
JOINTS = (
    "wrist",
    *(f"{finger}_{k}" for finger in ("thumb", *hand_shape.FINGERS) for k in (1, 2, 3, 4)),
)
"""Keypoints: the wrist, then four joints of every finger from its foot to its tip."""
_STEP_M = 0.0038
_MARGIN = 0.01
_SLEEVES = ("", "long", "pushed_up", "long", "", "short")


def hand(
    seed: int,
    pose: str = "any",
    radii_mm: Sequence[float] = (0.0,) * 4,
    bends_deg: Sequence[float] = (0.0,) * 15,
) -> Solid:
    """A left or right hand. Slots: skin, arm, nails, then sleeve.

    Args:
        seed: Draws size, skin, side and sleeve; with pose ``any`` also the pose.
        pose: One of ``POSE_NAMES``, ``open``, ``hold``, or ``any``, which is neither of the two.
        radii_mm: For ``grasp``: radius of the held object at index, middle, ring and little finger;
            all 0 = drawn.
        bends_deg: For ``hold``: dips below the palm of the bones of index, middle, ring, little
            finger and thumb.

    Raises:
        AssetError: if there is no such pose.
        ValueError: if a radius is outside ``RADII_M``.
    """
    pose, rng = hand_pose(seed, pose), variant_rng("hand", seed)
    # At a held object the hand has the tabulated size, which fits the radii.
    stout = rng.between(0.9, 1.04, "stout")
    size = 1.0 if pose in (GRASP, HOLD) else rng.between(0.9, 1.06, "size_scale")
    held = draw_radii(seed, radii_mm) if pose == GRASP else ()
    shown = "flat" if pose == OPEN else pose
    if pose == HOLD:
        dips = np.radians(np.array(bends_deg, dtype=np.float64).reshape(5, 3)).tolist()
        bones = hand_shape.closed_bones(dips[:4], dips[4], _lift_deg(seed))
    elif held:
        bones = hand_shape.grasp_bones(held, _lift_deg(seed))
    else:
        bones = hand_shape.pose_bones(shown)
    flesh = hand_shape.make_flesh_mesh(bones, stout, _STEP_M)
    skin, owner = _map_texture(flesh, bones, stout)
    plates = [_nail(bones, k, stout, rng).painted(2) for k in range(5)]
    arm, sleeve, arm_hulls = _arm(seed, bones, stout, rng)
    patches = [skin, arm, *plates, *([] if sleeve is None else [sleeve])]
    hulls = _hulls(skin, owner, plates)
    patches, hulls, joints = _orient(patches, [*hulls, *arm_hulls], bones, seed, pose, size)
    return _with_keypoints(patches, _materials(seed, rng, sleeve is not None), hulls, joints)


def hand_pose(seed: int, pose: str = "any") -> str:
    """The pose of a variant. Raises AssetError if there is no such pose."""
    return pose if pose in (HOLD, OPEN) else choose_option("hand", "pose", pose, POSE_NAMES, seed)


def is_left(seed: int) -> bool:
    """Whether it is a left hand: one in ten hands that hold objects (assumed)."""
    return seed % 2 == 1


def draw_radii(seed: int, radii_mm: Sequence[float]) -> tuple[float, ...]:
    """Radii of the held object at four fingers [m], as given or drawn.

    Raises:
        ValueError: if a radius is outside ``RADII_M``.
    """
    if not any(radii_mm):
        radius = round(variant_rng("hand/held", seed).between(0.02, 0.042), 3)
        return (radius,) * 4
    radii = tuple(0.001 * float(r) for r in radii_mm)
    low, high = RADII_M
    if not all(low - 1e-9 <= r <= high + 1e-9 for r in radii):
        raise ValueError(f"radii_mm={radii_mm} are not all from {1e3 * low:g} to {1e3 * high:g}")
    return radii


def held_axis_m(seed: int, radii_m: Sequence[float]) -> Vec3:
    """Vector from the keypoint ``index_1`` to the axis of the held object, at its height [m].

    In the frame of the asset, whose Z is parallel to that axis.
    """
    bones = hand_shape.grasp_bones(radii_m, _lift_deg(seed))
    assert bones.held
    offset = bones.held[0][0] - bones.chains[1][0]
    turned = _turned(offset[None], seed, GRASP)[0]
    return (float(turned[0]), float(turned[1]), 0.0)


def hand_facts(
    seed: int, pose: str = "any", radii_mm: Sequence[float] = (), bends_deg: Sequence[float] = ()
) -> Facts:
    """Pose, side, and skin tone on the scale of Monk (1 light to 10 dark)."""
    del radii_mm, bends_deg
    side = "left" if is_left(seed) else "right"
    return Facts(hand_pose(seed, pose), {"monk_skin_tone": str(_tone(seed) + 1), "side": side})


def _tone(seed: int) -> int:
    return in_turn((3, 1, 5, 6, 2, 8, 4, 0, 7, 9), seed // 2 + seed)


def _lift_deg(seed: int) -> float:
    """Angle of the forearm towards the thumb's side."""
    return variant_rng("hand/lift", seed).between(4.0, 12.0)


def _map_texture(flesh: Patch, bones: Bones, stout: float) -> tuple[Patch, Indices]:
    """Texture coordinates of the atlas of ``hand_skin``, and the part of each triangle.

    The left half of the image is the palm, its right half any finger; both sides of the hand share
    it, without a visible seam. Parts: 0 palm, then three bones per finger.
    """
    corners = flesh.corners_m
    middle = corners.mean(axis=1)
    parts = hand_shape.measure_flesh(middle, bones, stout)
    nearest = np.argmin([parts.palm - 0.002, *parts.fingers], axis=0)
    u = 0.5 * (corners[..., 1] + 0.055) / 0.11
    v = (corners[..., 0] + 0.03) / 0.14
    uvs = np.stack([np.clip(u, _MARGIN, 0.5 - _MARGIN), np.clip(v, _MARGIN, 1.0 - _MARGIN)], axis=2)
    owner = np.zeros(len(corners), dtype=np.int64)
    for k, chain in enumerate(bones.chains):
        mine = nearest == k + 1
        along, across = _along_finger(corners[mine].reshape(-1, 3), chain, bones.backs[k])
        finger_u = np.clip(0.75 + 0.25 * across / 0.011, 0.5 + _MARGIN, 1.0 - _MARGIN)
        finger_v = np.clip(along / 3.0, _MARGIN, 1.0 - _MARGIN)
        uvs[mine] = np.stack([finger_u, finger_v], axis=1).reshape(-1, 3, 2)
        centre, _ = _along_finger(middle[mine], chain, bones.backs[k])
        owner[mine] = 1 + 3 * k + np.minimum(centre.astype(np.int64), 2)
    return Patch(corners, uvs, flesh.slots), owner


def _along_finger(points: Array, chain: Array, back: Array) -> tuple[Array, Array]:
    """Bones from the foot of a finger (0 to 3), and the distance from its middle plane [m]."""
    best, along, across = np.full(len(points), np.inf), np.zeros(len(points)), np.zeros(len(points))
    for bone in range(3):
        a, b = chain[bone], chain[bone + 1]
        share = np.clip((points - a) @ (b - a) / float((b - a) @ (b - a)), 0.0, 1.0)
        offset = points - a - share[:, None] * (b - a)
        away = (offset**2).sum(axis=1)
        closer = away < best
        side = unit(np.cross(back, b - a)[None])[0]
        best = np.where(closer, away, best)
        along = np.where(closer, bone + share, along)
        across = np.where(closer, offset @ side, across)
    return along, across


def _hulls(skin: Patch, owner: Indices, nails: Sequence[Patch]) -> list[Array]:
    """Convex parts of palm and bones; parts of last bones enclose their nails."""
    made = []
    for part in sorted(set(owner.tolist())):
        points = skin.corners_m[owner == part].reshape(-1, 3)
        if part and part % 3 == 0:
            points = np.concatenate([points, nails[part // 3 - 1].corners_m.reshape(-1, 3)])
        made.append(food_shapes.wrap(points, 32))
    return made


def _nail(bones: Bones, k: int, stout: float, rng: VariantRng) -> Patch:
    """The nail of a finger: a curved plate on the back of its last bone."""
    chain, back = bones.chains[k], bones.backs[k]
    along = unit((chain[3] - chain[2])[None])[0]
    across = np.cross(back, along)
    radii = hand_shape.tip_radii(k)
    r = stout * (0.35 * radii[0] + 0.65 * radii[1])
    half_long, half_wide = r * rng.between(0.84, 1.0), 0.8 * r
    length = math.dist(chain[3], chain[2])
    centre = chain[2] + along * (length - 1.4 * half_long)

    def shape(d: Array) -> Array:
        # Rounded corners; the plate follows the finger's girth and sinks in at its root.
        x = half_long * np.sign(d[..., 0]) * np.abs(d[..., 0]) ** 0.6
        y = half_wide * np.sign(d[..., 1]) * np.abs(d[..., 1]) ** 0.75
        dome = np.sqrt(np.maximum((1.04 * r) ** 2 - y * y, 0.0))
        slope = 0.16 * (radii[0] - radii[1]) / radii[0] * x
        z = dome - slope - 0.0001 + 0.0005 * d[..., 2] - 0.0006 * np.maximum(-d[..., 0], 0.0) ** 4
        return np.asarray(
            centre + x[..., None] * along + y[..., None] * across + z[..., None] * back
        )

    return shapes.ball(shape, 6, 14)


def _arm(
    seed: int, bones: Bones, stout: float, rng: VariantRng
) -> tuple[Patch, Patch | None, list[Array]]:
    """The bare arm, the sleeve over it, and convex parts."""
    cuff = {"": ARM_M, "long": rng.between(0.002, 0.03), "pushed_up": rng.between(0.1, 0.16),
            "short": ARM_M}[in_turn(_SLEEVES, seed // 3)]  # fmt: skip
    end = min(ARM_M, cuff + 0.03)
    bare = np.linspace(0.004, end, max(4, round(end / 0.03)))
    arm = _tube(hand_shape.arm_rings(bones, stout, bare, np.full(len(bare), -0.0002), 28)).painted(
        1
    )
    sleeve = None
    if cuff < ARM_M:
        steps = np.linspace(cuff, ARM_M, 22)
        loose = rng.between(0.004, 0.009)
        sides = 30
        turn = 2.0 * math.pi * np.arange(sides) / sides
        folds = np.zeros((len(steps), sides))
        for _ in range(5):
            k = rng.choose((1, 2, 2, 3))
            tilt = rng.between(60.0, 160.0)
            phase = rng.between(0.0, 6.28)
            folds += 0.0007 * np.sin(k * turn[None] + tilt * steps[:, None] + phase)
        hem = 0.0016 * np.exp(-(((steps - cuff) / 0.012) ** 2))[:, None]
        outer = hand_shape.arm_rings(bones, stout, steps, loose + folds + hem, sides)
        inner = hand_shape.arm_rings(
            bones, stout, steps[:1] + 0.0, np.array([loose - 0.0025]), sides
        )
        deep = hand_shape.arm_rings(bones, stout, steps[:1] + 0.02, np.array([0.0005]), sides)
        sleeve = _tube(np.concatenate([deep, inner, outer])).painted(3)
    shown = [arm] if sleeve is None else [arm, sleeve]
    points = np.concatenate([patch.corners_m.reshape(-1, 3) for patch in shown])
    along = points @ bones.arm
    hulls = [
        food_shapes.wrap(points[(along > a - 0.001) & (along < b + 0.04)])
        for a, b in ((0.0, 0.1), (0.1, 0.2), (0.2, 0.31), (0.31, ARM_M))
    ]
    return arm, sleeve, hulls


def _tube(rings: Array) -> Patch:
    """Rings of points, shape [n, sides, 3], joined and closed at both ends."""
    closed = np.concatenate([rings, rings[:, :1]], axis=1)
    wall = shapes.grid(closed)
    ends = [shapes.fan(rings[0, ::-1]), shapes.fan(rings[-1])]
    made = join_patches([wall, *ends])
    volume = np.einsum(
        "ni,ni->", made.corners_m[:, 0], np.cross(made.corners_m[:, 1], made.corners_m[:, 2])
    )
    return made if volume > 0.0 else made.flipped()


def _turned(points: Array, seed: int, pose: str) -> Array:
    """Points of the hand frame, mirrored if left; thumb up if it grasps, palm up if open."""
    mirrored = points * np.array([1.0, -1.0, 1.0]) if is_left(seed) else points
    if pose == OPEN:
        return rotate(mirrored, "x", math.pi)
    if pose != GRASP:
        return np.asarray(mirrored)
    return rotate(mirrored, "x", (-0.5 if is_left(seed) else 0.5) * math.pi)


def _orient(
    patches: Sequence[Patch],
    hulls: Sequence[Array],
    bones: Bones,
    seed: int,
    pose: str,
    size: float,
) -> tuple[list[Patch], list[Array], Array]:
    """All parts in the asset's orientation and size, and the joints in the order of ``JOINTS``."""
    made = []
    for patch in patches:
        moved = replace(patch, corners_m=size * _turned(patch.corners_m, seed, pose))
        made.append(moved.flipped() if is_left(seed) else moved)
    joints = np.concatenate([np.zeros((1, 3)), bones.chains.reshape(-1, 3)])
    return (
        made,
        [size * _turned(hull, seed, pose) for hull in hulls],
        size * _turned(joints, seed, pose),
    )


def _with_keypoints(
    patches: Sequence[Patch], materials: Sequence[Material], hulls: Sequence[Array], joints: Array
) -> Solid:
    solid = make_centred_solid(patches, materials, hulls)
    low, _ = join_patches(patches).bounds_m()
    shift = np.array(solid.mesh.bounds_m()[0]) - low
    points = tuple(
        Keypoint(name, (round(float(x), 6), round(float(y), 6), round(float(z), 6)), 0.02)
        for name, (x, y, z) in zip(JOINTS, joints + shift, strict=True)
    )
    return replace(solid, keypoints=points)


def _materials(seed: int, rng: VariantRng, has_sleeve: bool) -> list[Material]:
    skin = skin_color(_tone(seed), rng)
    rough = rng.between(0.42, 0.56)
    hand_texture, arm_texture = (
        f"texture/hand_skin?kind={k}&seed={seed % 8}" for k in ("hand", "arm")
    )
    nail: Vec3 = (min(1.0, 1.0 * skin[0] + 0.1), 0.92 * skin[1] + 0.06, 0.92 * skin[2] + 0.06)
    if rng.chance(0.18):
        nail = hex_to_linear(rng.choose(SKIN["varnishes"]))
    made = [
        Material(skin, rough, specular=0.4, texture=hand_texture, printed=True, role="skin"),
        Material(
            skin,
            rough,
            specular=0.4,
            texture=arm_texture,
            texture_scale_m=0.16,
            printed=True,
            role="skin",
        ),
        Material(nail, 0.24, printed=True, role="skin"),
    ]
    if has_sleeve:
        cloth = jitter_color(hex_to_linear(rng.choose(SKIN["sleeves"])), 0.1, rng)
        made.append(
            Material(cloth, 0.85, specular=0.3, texture=f"texture/fabric?seed={seed % 16}",
                     texture_scale_m=0.06, printed=True, role="top")
        )  # fmt: skip
    return made
