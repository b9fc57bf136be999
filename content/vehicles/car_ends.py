"""Fronts and rears of cars: lamps, grilles, intakes, bumpers, licence plates."""

import math
from collections.abc import Iterator

from gen_data.content.procedural.patches import Array, Patch
from gen_data.content.procedural.surface_shapes import Point2, block, lathe
from gen_data.content.vehicles.body_shell import BodyOutline, Level, paint
from gen_data.content.vehicles.car_design import FACES, TAILS, Design
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot

PLATE_M = (0.26, 0.055)
"""Half width and half height of a licence plate of 520 mm by 110 mm (ISO 7591, Annex A)."""
_PROUD_M = 0.004


def paint_ends(design: Design, ring: BodyOutline, patch: Patch) -> Patch:
    """The left half of a lower body with its front and rear painted."""
    return _paint_tail(design, ring, _paint_face(design, ring, patch))


def fit_ends(design: Design) -> Iterator[Patch]:
    """Parts in front of and behind the left half: bowls of lamps, emblems, fog lamps."""
    face, tail = FACES[design.face], TAILS[design.tail]
    z, y = design.lamp_m[0], design.half_m
    middle, height = z + 0.5 * sum(face.lamp_m), face.lamp_m[1] - face.lamp_m[0]
    inner, outer = (share * y for share in face.lamp)
    bowl = 0.5 * min(height - face.slant_m, 0.5 * (outer - inner))
    if face.optics == "round":
        radius = 0.5 * height
        at = 0.5 * (inner + outer)
        yield _lens(design, (at, middle), 1.16 * radius, Slot.CHROME, 0.008, front=True)
        yield _lens(design, (at, middle), radius, Slot.HEADLIGHT, 0.02, front=True)
    else:
        slot = Slot.HEADLIGHT if face.optics == "projectors" else Slot.CHROME
        for share in (0.25, 0.64):
            at = inner + share * (outer - inner)
            rise = 0.4 * face.slant_m
            yield _lens(design, (at, middle + rise), 0.86 * bowl, slot, 0.006, front=True)
    if face.fog:
        place = (face.fog * y, design.clearance_m + 0.5 * (face.intake[1] + face.intake[2]))
        yield _lens(design, place, 0.055, Slot.HOUSING, 0.003, front=True)
        yield _lens(design, place, 0.042, Slot.CLEAR_LENS, 0.006, front=True)
    if tail.round:
        z = design.lamp_m[1] + 0.5 * sum(tail.lamp_m)
        radius = 0.42 * (tail.lamp_m[1] - tail.lamp_m[0])
        for share, slot in ((0.3, Slot.TAILLIGHT), (0.72, Slot.BRAKELIGHT)):
            at = (tail.inner + share * (0.92 - tail.inner)) * y
            yield _lens(design, (at, z), 1.1 * radius, Slot.CHROME, 0.004, front=False)
            yield _lens(design, (at, z), radius, slot, 0.012, front=False)


def fit_middle(design: Design) -> Iterator[Patch]:
    """Emblems, and licence plates in their frames, which no mirror image doubles."""
    y, z = PLATE_M
    face, tail = FACES[design.face], TAILS[design.tail]
    high = design.lamp_m[0] + (sum(face.grille[1:]) * 0.5 if face.grille[0] else 0.0)
    if not design.upright_lamps:
        yield _lens(design, (0.0, high), 0.045, Slot.CHROME, 0.012, front=True)
        rear = design.lamp_m[1] + max(tail.lamp_m[1] - 0.03, 0.0)
        yield _lens(design, (0.0, rear), 0.035, Slot.CHROME, 0.006, front=False)
    heights = (
        max(design.clearance_m + 0.18, min(design.lamp_m[0] - 0.2, design.clearance_m + 0.36)),
        design.lamp_m[1] + tail.plate_m,
    )
    for at, front, slot in zip(heights, (True, False), (Slot.PLATE, Slot.REAR_PLATE), strict=True):
        ends = [abs(design.end_m(0.0, at + d, front=front)) for d in (-z, z)]
        # The foremost part of the surface behind the plate carries it.
        x, sign = max(ends) + 0.008, 1.0 if front else -1.0
        for half_y, half_z, depth, part in (
            (y + 0.012, z + 0.012, 0.004, Slot.TRIM),
            (y, z, 0.0, slot),
        ):
            far = sorted((sign * (x - depth), sign * (x - 0.06)))
            yield block((far[0], -half_y, at - half_z), (far[1], half_y, at + half_z), 0.0, part)


def lamp_points(design: Design) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Middle of the left headlight and of the left tail light."""
    face, tail = FACES[design.face], TAILS[design.tail]
    y = 0.5 * sum(face.lamp) * design.half_m
    z = design.lamp_m[0] + 0.5 * sum(face.lamp_m)
    back = 0.5 * (tail.inner + 0.92) * design.half_m
    low = design.lamp_m[1] + 0.5 * sum(tail.lamp_m)
    return (
        (design.end_m(y, z, front=True), y, z),
        (design.end_m(back, low, front=False), back, low),
    )


def _lens(
    design: Design, place: Point2, radius_m: float, slot: int, depth_m: float, *, front: bool
) -> Patch:
    """A shallow dome on the surface at (y, z), turned as the surface is seen from above."""
    y, z = place
    ends = [design.end_m(y + d, z, front=front) for d in (-0.5 * radius_m, 0.5 * radius_m)]
    turn = math.atan2(ends[0] - ends[1], radius_m)
    profile = [(radius_m, 0.0), (0.7 * radius_m, 0.7 * depth_m), (0.0, depth_m)]
    dome = lathe(profile, 10, slot).rotated("y", 0.5 * math.pi)
    yaw = turn if front else math.pi + turn
    x = max(ends) if front else min(ends)
    sign = 1.0 if front else -1.0
    return dome.rotated("z", yaw).moved(0.5 * (x + 0.5 * sum(ends)) + sign * _PROUD_M, y, z)


def _above_slope(z_m: float, slope: float) -> Level:
    """Positive above a line that rises by ``slope`` per metre from the middle outwards."""

    def level(p: Patch) -> Array:
        return p.corners_m[..., 2] - z_m - slope * p.corners_m[..., 1]

    return level


def _paint_face(design: Design, ring: BodyOutline, patch: Patch) -> Patch:
    face, z, y = FACES[design.face], design.lamp_m[0], design.half_m
    front, at = (0.5 * design.length_m - 0.9, None), ring.front
    if design.bare_bumpers:
        top = z + face.lamp_m[0] - 0.03
        rise = (design.clearance_m + 0.12, min(top, design.clearance_m + 0.42))
        patch = paint(patch, Slot.PLASTIC, x=(0.5 * design.length_m - 0.62, None), z=rise)
    half, low, high = face.intake
    low, high = design.clearance_m + low, min(design.clearance_m + high, z + face.lamp_m[0] - 0.03)
    if half:
        patch = paint(patch, Slot.TRIM, x=front, y=(None, half * y), z=(low, high))
    half, low, high = face.grille
    if half:
        patch = _paint_grille(design, patch, front)
    slope = face.slant_m / max((face.lamp[1] - face.lamp[0]) * y, 0.05)
    start = z + face.lamp_m[0] - slope * face.lamp[0] * y
    edge = at(min(face.lamp[1], 0.93)) + (0.025 if face.lamp[1] > 0.93 else 0.0)
    across = (at(face.lamp[0]), edge)
    frame = (at(max(face.lamp[0] - 0.03, 0.0)), edge + 0.004)
    patch = paint(patch, Slot.HOUSING, _above_slope(start - 0.014, slope), x=front, ring=frame,
                  z=(z + face.lamp_m[0] - 0.014, z + face.lamp_m[1] + 0.01))  # fmt: skip
    lens = {"x": front, "ring": across, "z": (z + face.lamp_m[0], z + face.lamp_m[1])}
    if face.optics == "reflectors":
        patch = paint(patch, Slot.HEADLIGHT, _above_slope(start, slope), **lens)
    low, high = face.daylight_m
    if high > low:
        patch = paint(patch, Slot.CLEAR_LENS, x=front, ring=across, z=(z + low, z + high))
    outer = (at(min(0.35 * face.lamp[0] + 0.65 * face.lamp[1], 0.93)), edge)
    wink_z = (z + face.lamp_m[0], z + face.lamp_m[0] + 0.45 * (face.lamp_m[1] - face.lamp_m[0]))
    if face.optics == "round":
        wink_z = (z + face.lamp_m[0] - 0.1, z + face.lamp_m[0] - 0.05)
    elif face.optics == "projectors":
        # A strip of light emitting diodes along the upper edge of the lamp.
        wink_z = (z + face.lamp_m[1] - 0.022, z + face.lamp_m[1] - 0.008)
    elif face.slant_m > 0.03:
        wink_z = (wink_z[0] + 0.6 * face.slant_m, wink_z[1] + 0.6 * face.slant_m)
    return paint(patch, Slot.INDICATOR_LEFT, x=front, ring=outer, z=wink_z)


def _paint_grille(design: Design, patch: Patch, front: tuple[float, None]) -> Patch:
    """A dark opening with bars and, if they are chromed, a frame."""
    face, z, y = FACES[design.face], design.lamp_m[0], design.half_m
    half, low, high = face.grille[0] * y, z + face.grille[1], z + face.grille[2]
    bright = Slot.CHROME if face.chrome else Slot.PAINT
    if face.chrome:
        patch = paint(patch, bright, x=front, y=(None, half + 0.015), z=(low - 0.012, high + 0.012))
    patch = paint(patch, Slot.TRIM, x=front, y=(None, half), z=(low, high))
    for k in range(face.bars):
        at = low + (k + 1) / (face.bars + 1) * (high - low)
        patch = paint(patch, bright, x=front, y=(None, half), z=(at - 0.006, at + 0.006))
    return patch


def _paint_tail(design: Design, ring: BodyOutline, patch: Patch) -> Patch:
    tail, z, y = TAILS[design.tail], design.lamp_m[1], design.half_m
    rear, rows = (None, -0.5 * design.length_m + 0.6), (0.1, 0.985)
    if design.bare_bumpers:
        rise = (design.clearance_m + 0.14, min(z - 0.2, design.clearance_m + 0.42))
        patch = paint(patch, Slot.PLASTIC, x=(None, -0.5 * design.length_m + 0.55), z=rise)
    low, high = z + tail.lamp_m[0], z + tail.lamp_m[1]
    inner = ring.rear(tail.inner)
    outer, stop = ring.rear(0.93) - 0.02, ring.rear(0.5 * tail.inner + 0.42)
    where = {"x": rear, "row": rows}
    if tail.band:
        strip = (low + 0.35 * (high - low), low + 0.65 * (high - low))
        patch = paint(patch, Slot.TAILLIGHT, y=(None, tail.inner * y + 0.05), z=strip, **where)
    base = Slot.HOUSING if tail.round else Slot.TAILLIGHT
    patch = paint(patch, base, ring=(outer, inner), z=(low, high), **where)
    middle, quarter = low + 0.5 * (high - low), low + 0.28 * (high - low)
    if design.upright_lamps or tail.amber:
        patch = paint(
            patch,
            Slot.INDICATOR_LEFT,
            ring=(ring.rear(0.9), inner),
            z=(middle, middle + 0.3 * (high - middle)),
            **where,
        )
    else:
        patch = paint(
            patch, Slot.INDICATOR_LEFT, ring=(ring.rear(0.9), stop), z=(low, quarter), **where
        )
    if not tail.round:
        patch = paint(patch, Slot.BRAKELIGHT, ring=(outer, stop), z=(quarter, middle), **where)
        patch = paint(patch, Slot.CLEAR_LENS, ring=(stop, inner), z=(low, quarter), **where)
    lid = z - 0.335 if tail.plate_m > -0.3 else z - 0.18
    patch = paint(patch, Slot.TRIM, x=rear, y=(None, 0.7 * y), z=(lid, lid + 0.008))
    recess = (z + tail.plate_m - 0.09, z + tail.plate_m + 0.085)
    patch = paint(patch, Slot.HOUSING, x=rear, y=(None, 0.3), z=recess)
    skirt = (None, design.clearance_m + 0.17)
    return paint(patch, Slot.TRIM, x=rear, y=(None, 0.72 * y), z=skirt, row=(0, 2))
