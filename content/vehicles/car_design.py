"""Designs of cars and vans, and where their surfaces are."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gen_data.config.data_files import load_table
from gen_data.content.procedural.surface_shapes import Point2
from gen_data.content.vehicles.body_shell import BODY_ROWS, Curve, smooth_height
from gen_data.content.vehicles.wheels import Axles

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Face:
    """The front of a car.

    Across, shares are of the half width; heights are relative to the headlights' middle [m].

    Attributes:
        lamp: From where to where the headlights reach across.
        lamp_m: Their lower and upper edge.
        slant_m: How much the lower edge rises from the car's middle to its side.
        optics: Reflectors behind a bright lens, projectors in a dark housing, or round lamps.
        daylight_m: Lower and upper edge of a strip of light emitting diodes; equal = none.
        grille: Half width, lower and upper edge; width 0 = none.
        bars: Number of bright bars across the grille.
        chrome: Whether bars and frame of the grille are chromed, else painted.
        intake: Half width and, above the underbody, lower and upper edge of the lower intake.
        fog: Distance of fog lamps from the middle; 0 = none.
    """

    lamp: Point2
    lamp_m: Point2
    slant_m: float
    optics: Literal["reflectors", "projectors", "round"]
    daylight_m: Point2
    grille: Triple
    bars: int
    chrome: bool
    intake: Triple
    fog: float


@dataclass(frozen=True)
class Tail:
    """The rear of a car; measures as in ``Face``, relative to the tail lights' middle.

    Attributes:
        inner: Where the lamps begin across, as a share of the half width.
        lamp_m: Their lower and upper edge.
        band: Whether a bar of light or of red plastic joins them.
        round: Whether the lamps are round.
        amber: Whether the indicators have amber lenses, else they hide behind red ones.
        plate_m: Height of the licence plate's middle.
    """

    inner: float
    lamp_m: Point2
    band: bool
    round: bool
    amber: bool
    plate_m: float


@dataclass(frozen=True)
class Era:
    """How the same kind of car was built at a time.

    Attributes:
        size: Factors on length, width and height.
        wheel_m: Added to the radius of the wheels.
        belt_m: Added to the height of the belt, nose and lamps.
        rows, house_rows: Rows of ``body_rows.yaml``.
        ends: Factor on the exponents of the plan: above 1 = squarer.
        roof_share: Added to the share of the roof's half width.
        faces, tails: Names of faces and tails to draw from.
        wheels: Names of wheel designs to draw from.
        bare_bumpers: Probability that bumpers are not painted.
        strips: Probability of rub strips along the doors.
    """

    size: Triple
    wheel_m: float
    belt_m: float
    rows: str
    house_rows: str
    ends: float
    roof_share: float
    faces: tuple[str, ...]
    tails: tuple[str, ...]
    wheels: tuple[str, ...]
    bare_bumpers: float
    strips: float


@dataclass(frozen=True)
class Design:
    """Design of a car or van.

    Shares are of the length from the front bumper; heights are above the ground.

    Attributes:
        length_m, width_m, height_m: Overall, without mirrors.
        wheelbase_m, front_axle_m: Distance between the axles; of the front axle from the bumper.
        wheel_radius_m: Radius of the wheels.
        clearance_m: Ground clearance of the underbody.
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
        wheel: Name of the wheels' design.
        rows, house_rows: Rows of ``body_rows.yaml``.
        face, tail: Names of the front and the rear.
        bare_bumpers: Whether the bumpers are of unpainted plastic.
        strip: Whether there are rub strips along the doors.
        soft_top: Whether the roof is of canvas.
        bed: Share where an open load bed begins; 0 = none.
        extras: Words of ``car_fittings``: ``antenna``, ``fin``, ``roof_box``, ``roof_bars``,
            ``tow_bar``, ``spoiler``, ``exhaust``, ``twin_exhaust``.
    """

    length_m: float
    width_m: float
    height_m: float
    wheelbase_m: float
    front_axle_m: float
    wheel_radius_m: float
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
    wheel: str = "five"
    rows: str = "car"
    house_rows: str = "glass_house"
    face: str = "swept"
    tail: str = "corners"
    bare_bumpers: bool = False
    strip: bool = False
    soft_top: bool = False
    bed: float = 0.0
    extras: tuple[str, ...] = ()

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
            design=self.wheel,
        )

    def shoulder(self) -> Curve:
        """Height of the edge between side and hood, belt and boot lid."""
        return smooth_height(
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

    def end_m(self, y_m: float, z_m: float, *, front: bool) -> float:
        """The x of the body's front or rear surface at a distance from the middle and a height."""
        rises, front_m, rear_m, shares = np.array(BODY_ROWS[self.rows]).T
        high = self.nose_m if front else self.tail_m
        rise = (z_m - self.clearance_m) / (high - self.clearance_m)
        stand_m, share = (
            float(np.interp(rise, rises, row)) for row in (front_m if front else rear_m, shares)
        )
        p, q = self.body_ends[0 if front else 1]
        across = min(abs(y_m) / (share * self.half_m), 1.0)
        reach = (1.0 - across**q) ** (1.0 / p)
        end, far = 0.5 * self.length_m - stand_m, 0.5 * self.length_m
        x_m = float(0.5 * (end - far) + 0.5 * (end + far) * reach)
        return x_m if front else -x_m


DESIGNS = load_table(__package__, "designs", Design)
ERAS = load_table(__package__, "eras", Era)
FACES = load_table(__package__, "faces", Face)
TAILS = load_table(__package__, "tails", Tail)


def read_models(rows: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Pairs of body and era from lines of ``body era, body era, ...``."""
    made = []
    for row in rows:
        for model in row.split(","):
            body, era = model.split()
            made.append((body, era))
    return tuple(made)


MODELS = {
    name: read_models(rows)
    for name, rows in load_table(__package__, "models", tuple[str, ...]).items()
}
