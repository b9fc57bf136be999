"""Cartons with realistic details: joints, tape, labels with bar codes, printed arrows."""

from collections.abc import Sequence

from gen_data.content.procedural import surface_shapes as shapes
from gen_data.content.procedural.material_presets import painted_material, patterned_material
from gen_data.content.procedural.patches import Patch
from gen_data.core import asset_types, variant_rng


def tape_carton(
    patches: list[Patch],
    low: Sequence[float],
    high: Sequence[float],
    rng: variant_rng.VariantRng,
    slots: tuple[int, int, int, int],
) -> None:
    """Add a closed carton: body, tape over the joint of its flaps, a label, printed marks.

    Args:
        patches: List to which its patches are added.
        low: Its lower corner [m].
        high: Its upper corner [m].
        rng: Draws.
        slots: Material slots of card, tape, label and print.
    """
    card, tape, label, ink = slots
    (x0, y0, z0), (x1, y1, z1) = low, high
    patches.append(shapes.block(low, high, 0.003, card))
    middle, t = 0.5 * (y0 + y1), 0.0006
    # Tape runs along the longer side and hangs over the ends.
    patch = shapes.block(
        (x0 - t, middle - 0.025, z1 - 0.002), (x1 + t, middle + 0.025, z1 + t), 0.0, tape
    )
    patches.append(patch)
    patches += [
        shapes.block((x - t, middle - 0.025, z1 - 0.06), (x + t, middle + 0.025, z1 + t), 0.0, tape)
        for x in (x0, x1)
    ]
    # The joint of the flaps, and labels and marks on all four sides.
    for axis, sign in ((0, 1), (0, -1), (1, 1), (1, -1)):
        a0, a1 = (y0, y1) if axis == 0 else (x0, x1)
        face = (x1 if sign > 0 else x0) if axis == 0 else (y1 if sign > 0 else y0)
        long, high_m = a1 - a0, z1 - z0
        if rng.chance(0.55):
            w, h = min(0.16, 0.45 * long), min(0.105, 0.4 * high_m)
            a = a0 + rng.between(0.08, 0.45) * long
            z = z0 + rng.between(0.2, 0.5) * high_m
            patches.append(_sticker(axis, face, (a, a + w), (z, z + h), label))
            for k in range(6):
                b = a + 0.1 * w + 0.13 * w * k
                patches.append(
                    _sticker(
                        axis,
                        face + 2e-4 * sign,
                        (b, b + (0.02 + 0.02 * (k % 3)) * w),
                        (z + 0.12 * h, z + 0.5 * h),
                        ink,
                    )
                )
            patches.append(
                _sticker(
                    axis,
                    face + 2e-4 * sign,
                    (a + 0.1 * w, a + 0.7 * w),
                    (z + 0.68 * h, z + 0.76 * h),
                    ink,
                )
            )
        if rng.chance(0.4):
            # Arrows: this side up.
            a, z, s = a0 + 0.8 * long, z0 + 0.55 * high_m, min(0.05, 0.2 * high_m)
            for k in range(2):
                b = a + 0.06 * long * k
                patches.append(_sticker(axis, face, (b, b + 0.2 * s), (z, z + s), ink))
                patches.append(
                    _sticker(axis, face, (b - 0.15 * s, b + 0.35 * s), (z + s, z + 1.15 * s), ink)
                )


def _sticker(
    axis: int, face: float, across: tuple[float, float], up: tuple[float, float], slot: int
) -> Patch:
    """A thin rectangle on a side of a box."""
    t = 0.0005
    if axis == 0:
        low, high = (face - t, across[0], up[0]), (face + t, across[1], up[1])
    else:
        low, high = (across[0], face - t, up[0]), (across[1], face + t, up[1])
    return shapes.block(low, high, 0.0, slot)


def carton_looks(rng: variant_rng.VariantRng, seed: int) -> list[asset_types.Material]:
    """Materials of ``tape_carton``: card, tape, label, print."""
    pale = rng.chance(0.2)
    card = (
        painted_material("#e9e6de", 0.8)
        if pale
        else patterned_material(f"texture/cardboard?seed={seed % 16}", 0.6, 0.85)
    )
    tape = rng.choose(("#b08a55", "#c9a36a", "#e6dcc4", "#8c6a42"))
    ink = rng.choose(("#22221f", "#22221f", "#1f4e8c", "#a3261d"))
    return [
        card,
        painted_material(tape, 0.25),
        painted_material("#f5f3ec", 0.7),
        painted_material(ink, 0.7),
    ]
