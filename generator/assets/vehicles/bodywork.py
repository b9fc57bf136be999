"""Cars and vans: lower body with hood, glass house, and fittings."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from gen_data.generator.assets.procedural import collision_hulls as hulls
from gen_data.generator.assets.procedural.data_tables import load_table
from gen_data.generator.assets.procedural.family import Solid
from gen_data.generator.assets.procedural.patches import Array, Patch, join_patches
from gen_data.generator.assets.procedural.surface_shapes import Point2, block, rounded_box
from gen_data.generator.assets.scenery.basic_shapes import make_solid
from gen_data.generator.assets.vehicles import body_shell
from gen_data.generator.assets.vehicles.body_shell import (
    BODY_ROWS,
    BodyOutline,
    Curve,
    Row,
    body_rows,
    level_height,
    paint,
)
from gen_data.generator.assets.vehicles.vehicle_materials import SIDES
from gen_data.generator.assets.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.generator.assets.vehicles.wheels import Axles
from gen_data.generator.core.asset_types import Keypoint, Material


@dataclass(frozen=True)
class Design:
    """Design of a car or van.

    Shares are of the length from the front bumper; heights are above the ground.

    Attributes:
        length_m, width_m, height_m: Overall, without mirrors.
        wheelbase_m, front_axle_m: Distance of the axles; of the front one from the bumper.
        wheel_radius_m, spokes: Wheels; 0 spokes = steel wheels.
        clearance_m: Of the underbody.
        nose_m, cowl_m, belt_m, tail_m: Height of the shoulder along the car.
        cowl, header, roof_end, rear_base: Shares where windscreen and rear window begin and end.
        waist_share, roof_share: Half width below the windows and of the roof over the body's.
        body_ends, house_ends: Exponents of the plan in front and behind.
        seams: Shares of the vertical door gaps.
        pillars: Shares of the pillars between side windows.
        windows_to: Share where the side windows end.
        rear_window: Whether the rear is glazed.
        cladding: Whether sills and wheel arches are of black plastic.
        rails: Whether there are roof rails.
        lamp_m: Height of the headlights' middle, and of the tail lights'.
        upright_lamps: Whether tail lights stand in the rear corners, as on vans.
    """

    length_m: float
    width_m: float
    height_m: float
    wheelbase_m: float
    front_axle_m: float
    wheel_radius_m: float
    spokes: int
    clearance_m: float
    nose_m: float
    cowl_m: float
    belt_m: float
    tail_m: float
    cowl: float
    header: float
    roof_end: float
    rear_base: float
    waist_share: float
    roof_share: float
    body_ends: tuple[Point2, Point2]
    house_ends: tuple[Point2, Point2]
    seams: tuple[float, ...]
    pillars: tuple[float, ...]
    windows_to: float
    rear_window: bool
    cladding: bool
    rails: bool
    lamp_m: Point2
    upright_lamps: bool

    def x(self, share: float) -> float:
        """Coordinate of a share of the length."""
        return self.length_m * (0.5 - share)

    @property
    def half_m(self) -> float:
        """Half of the width."""
        return 0.5 * self.width_m

    @property
    def axles(self) -> Axles:
        """Position and size of the wheels."""
        front, tyre = 0.5 * self.length_m - self.front_axle_m, 0.66 * self.wheel_radius_m
        return Axles(
            front_m=front,
            rear_m=front - self.wheelbase_m,
            hub_y_m=0.975 * self.half_m - 0.5 * tyre,
            radius_m=self.wheel_radius_m,
            tyre_m=tyre,
            arch_m=self.wheel_radius_m + (0.055 if self.cladding else 0.045),
            spokes=self.spokes,
        )

    def shoulder(self) -> Curve:
        """Height of the edge between side and hood, belt and boot lid."""
        return body_shell.smooth_height(
            [
                (self.x(1.0), self.tail_m - 0.01),
                (self.x(0.9), self.tail_m),
                (self.x(0.6), self.belt_m),
                (self.x(self.cowl + 0.05), self.cowl_m + 0.01),
                (self.x(0.5 * self.cowl + 0.02), 0.35 * self.nose_m + 0.65 * self.cowl_m),
                (self.x(0.03), self.nose_m),
                (self.x(0.0), self.nose_m - 0.03),
            ]
        )


DESIGNS = load_table(__package__, "designs", Design)


def make_vehicle(design: Design, steer_deg: float, finish: tuple[Material, ...]) -> Solid:
    """The vehicle of a design with steered front wheels."""
    panels, fittings = _panels(design), list(_fittings(design))
    middle = [*_plates(design), *design.axles.wheels(steer_deg)]
    middle = [body_shell.drop_uvs(patch) for patch in middle]

    def both_sides(half: list[Patch]) -> list[Patch]:
        return [body_shell.mirror_half(join_patches(half), SIDES), *middle]

    body = both_sides([*panels, *fittings])
    whole = both_sides([*panels, *_mirror(design), *fittings])
    return make_solid(whole, finish, _collision(design), _keypoints(design), body)


def _panels(design: Design) -> list[Patch]:
    """Lower body and glass house, left half."""
    ring = body_shell.plan(*design.body_ends, sides=20)
    plain = _lower(design, ring)
    lower, wells = design.axles.wells(_lower_paint(design, ring, plain), design.half_m)
    gaps = _gaps(design, design.axles.wells(plain, design.half_m)[0])
    return [lower, *wells, *gaps, _house(design)]


def _collision(design: Design) -> list[Array]:
    """Body and glass house as boxes."""
    x, y, axles = 0.5 * design.length_m, design.half_m, design.axles
    house = 0.5 * (1.0 + design.roof_share) * 0.92 * y
    front, rear = (
        design.x(0.5 * (design.cowl + design.header)),
        design.x(0.5 * (design.roof_end + design.rear_base)),
    )
    return [
        hulls.box((-x, -y, design.clearance_m), (x, y, design.belt_m)),
        hulls.box((rear, -house, design.belt_m), (front, house, design.height_m)),
        hulls.box((axles.rear_m - axles.radius_m, -0.9 * y, 0.0),
                  (axles.front_m + axles.radius_m, 0.9 * y, design.clearance_m)),
    ]  # fmt: skip


def _keypoints(design: Design) -> tuple[Keypoint, ...]:
    """Hubs and lamps."""
    x, y = 0.5 * design.length_m, design.half_m
    head, tail = design.lamp_m
    return design.axles.keypoints((x - 0.2, 0.74 * y, head), (-x + 0.14, 0.8 * y, tail))


def _lower(design: Design, ring: BodyOutline) -> Patch:
    x, y = 0.5 * design.length_m, design.half_m
    rows = body_rows("car", x, -x, y)
    floor = level_height(design.clearance_m)
    body = body_shell.stack(ring, rows, floor, design.shoulder(), crown_m=0.055, lid_rows=2)
    # The part under the glass house is never visible.
    hidden = np.all(
        (body.uvs[..., 1] >= 1.0)
        & (body.corners_m[..., 0] < design.x(design.cowl) - 0.35)
        & (body.corners_m[..., 0] > design.x(design.rear_base) + 0.2)
        & (body.corners_m[..., 1] < 0.8 * y),
        axis=1,
    )
    return body_shell.take_triangles(body, ~hidden)


def _lower_paint(design: Design, ring: BodyOutline, patch: Patch) -> Patch:
    """Bumpers, lamps, grille and the gaps around doors and lids."""
    x, floor = 0.5 * design.length_m, design.clearance_m
    sill = floor + (0.15 if design.cladding else 0.07)
    patch = paint(patch, Slot.UNDERBODY, row=(-2.0, 0.0))
    patch = paint(patch, Slot.TRIM, row=(0.0, 2.0), z=(None, sill))
    if design.cladding:
        axles = design.axles
        for x_m in (axles.front_m, axles.rear_m):
            arch = body_shell.round_x_z(x_m, axles.radius_m, axles.arch_m + 0.055, 0.4)
            patch = paint(patch, Slot.TRIM, arch, row=(0.0, 1.0))
    patch = _front_paint(design, ring, patch)
    patch = _rear_paint(design, ring, patch)
    hood = (x - 0.3, design.x(design.cowl) + 0.1)
    return paint(patch, Slot.TRIM, row=(0.975, 0.988), x=hood)


def _gaps(design: Design, plain: Patch) -> list[Patch]:
    """The lines around the doors."""
    return [
        body_shell.gap(plain, design.x(share), 0.009, Slot.TRIM, row=(0.1, 0.99), y=(0.5, None))
        for share in design.seams
    ]


def _front_paint(design: Design, ring: BodyOutline, patch: Patch) -> Patch:
    z, y, floor = design.lamp_m[0], design.half_m, design.clearance_m
    front, lamp, outer = (0.5 * design.length_m - 0.8, None), ring.front, ring.front(0.93)

    def bezel(p: Patch) -> Array:
        return p.corners_m[..., 2] - (z - 0.17) - 0.13 / y * p.corners_m[..., 1]

    around = (lamp(0.44), outer + 0.03)
    patch = paint(patch, Slot.TRIM, bezel, x=front, ring=around, z=(z - 0.085, z + 0.075))
    lens = (lamp(0.52), outer + 0.022)
    patch = paint(patch, Slot.HEADLIGHT, x=front, ring=lens, z=(z - 0.055, z + 0.066))
    wink = (lamp(0.8), outer + 0.01)
    patch = paint(patch, Slot.INDICATOR_LEFT, x=front, ring=wink, z=(z - 0.055, z - 0.025))
    patch = paint(patch, Slot.TRIM, x=front, y=(None, 0.4 * y), z=(z - 0.11, z + 0.04))
    return paint(patch, Slot.TRIM, x=front, y=(None, 0.68 * y), z=(floor + 0.08, z - 0.28))


def _rear_paint(design: Design, ring: BodyOutline, patch: Patch) -> Patch:
    z, y = design.lamp_m[1], design.half_m
    rear, rows = (None, -0.5 * design.length_m + 0.6), (0.1, 0.985)
    low, high = (z - 0.22, z + 0.2) if design.upright_lamps else (z - 0.09, z + 0.08)
    inner = 0.78 if design.upright_lamps else 0.5
    outer, stop = ring.rear(0.93) - 0.02, ring.rear(0.5 * inner + 0.4)
    lamp = (outer, ring.rear(inner))
    patch = paint(patch, Slot.TAILLIGHT, x=rear, ring=lamp, row=rows, z=(low, high))
    middle = (low, 0.5 * (low + high))
    patch = paint(patch, Slot.BRAKELIGHT, x=rear, ring=(outer, stop), row=rows, z=middle)
    wink, height = (ring.rear(0.9), stop), (low, low + 0.28 * (high - low))
    patch = paint(patch, Slot.INDICATOR_LEFT, x=rear, ring=wink, row=rows, z=height)
    patch = paint(patch, Slot.TRIM, x=rear, y=(None, 0.7 * y), z=(z - 0.335, z - 0.327))
    skirt = (None, design.clearance_m + 0.17)
    return paint(patch, Slot.TRIM, x=rear, y=(None, 0.72 * y), z=skirt, row=(0, 2))


def _house(design: Design) -> Patch:
    """Glass house and roof."""
    ring = body_shell.plan(*design.house_ends, sides=10)
    crown, shoulder = 0.035, design.shoulder()
    wide = design.waist_share * design.half_m
    narrow = design.roof_share * design.half_m
    x = [design.x(s) for s in (design.cowl, design.header, design.roof_end, design.rear_base)]
    rows = [
        Row(rise, x[0] + front * (x[1] - x[0]), x[3] + rear * (x[2] - x[3]),
            wide + lean * (narrow - wide))
        for rise, front, rear, lean in BODY_ROWS["glass_house"]
    ]  # fmt: skip
    top = design.height_m - crown
    middle = 0.55 * x[1] + 0.45 * x[2]
    roof = body_shell.smooth_height([(x[3], top - 0.05), (x[2], top - 0.035), (middle, top),
                          (x[1], top - 0.03), (x[0], top - 0.06)])  # fmt: skip

    def base(at: Array) -> Array:
        return shoulder(at) - 0.03

    house = body_shell.stack(ring, rows, base, roof, crown_m=crown, lid_rows=2)
    _, house, _ = body_shell.split_patch(house, lambda p: -p.uvs[..., 1])
    return _glaze(design, ring, house)


def _glaze(design: Design, ring: BodyOutline, house: Patch) -> Patch:
    def before_end(p: Patch) -> Array:
        end = design.x(design.windows_to)
        return p.corners_m[..., 0] - end + 0.25 * p.corners_m[..., 2]

    house = paint(house, Slot.GLASS, ring=(-1.0, ring.front(0.83)), row=(0.04, 0.91))
    if design.rear_window:
        house = paint(house, Slot.GLASS, ring=(ring.rear(0.8), 2.0), row=(0.16, 0.87))
    side, rows = (ring.front(0.92) + 0.035, ring.rear(0.92) - 0.03), (0.09, 0.9)
    house = paint(house, Slot.GLASS, before_end, ring=side, row=rows)
    for share in design.pillars:
        post = (design.x(share) - 0.035, design.x(share) + 0.035)
        house = paint(house, Slot.TRIM, before_end, x=post, ring=side, row=rows)
    return house


def _mirror(design: Design) -> Iterable[Patch]:
    """The left exterior mirror."""
    shoulder = design.shoulder()
    y = design.half_m
    mirror_x = design.x(design.cowl + 0.42 * (design.header - design.cowl))
    z = float(shoulder(np.array(mirror_x))) + 0.1
    yield (
        rounded_box((0.13, 0.2, 0.14), 0.045, 1).moved(mirror_x, y + 0.07, z).painted(Slot.PAINT)
    )
    face = block((mirror_x - 0.07, y - 0.01, z - 0.05), (mirror_x - 0.06, y + 0.15, z + 0.05))
    yield face.painted(Slot.CHROME)
    yield block(
        (mirror_x - 0.03, 0.86 * y, z - 0.1), (mirror_x + 0.03, y, z - 0.04), 0.0, Slot.TRIM
    )


def _fittings(design: Design) -> Iterable[Patch]:
    """Door handles, roof rail: the left one of each."""
    shoulder, y = design.shoulder(), design.half_m
    for share in design.seams[1:]:
        x = design.x(share) + 0.16
        z = float(shoulder(np.array(x))) - 0.13
        yield block((x - 0.1, 0.95 * y, z), (x + 0.1, y + 0.012, z + 0.03), 0.0, Slot.PAINT)
    if design.rails:
        front, rear = design.x(design.header + 0.05), design.x(design.roof_end - 0.04)
        at = design.roof_share * y - 0.06
        top = design.height_m
        yield block((rear, at - 0.015, top - 0.06), (front, at + 0.015, top), 0.0, Slot.CHROME)


def _plates(design: Design) -> Iterable[Patch]:
    x = 0.5 * design.length_m
    z = design.lamp_m[0] - 0.2
    yield block((x - 0.03, -0.26, z - 0.055), (x + 0.008, 0.26, z + 0.055), 0.0, Slot.PLATE)
    z = design.lamp_m[1] - 0.2 if not design.upright_lamps else design.lamp_m[1] - 0.3
    yield block((-x - 0.002, -0.26, z - 0.055), (-x + 0.05, 0.26, z + 0.055), 0.0, Slot.PLATE)
