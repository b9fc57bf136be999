"""Taxis, police cars, ambulances, vans of post and parcel services, food trucks."""

from dataclasses import replace

from gen_data.assets.family import Solid
from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.content.procedural.patches import Patch
from gen_data.content.procedural.surface_shapes import Point2, block
from gen_data.content.scenery.basic_shapes import tube
from gen_data.content.vehicles import bodywork, cars, liveries
from gen_data.content.vehicles.car_design import Design, read_models
from gen_data.content.vehicles.vehicle_materials import COLORS, Print, materials
from gen_data.content.vehicles.vehicle_materials import VehicleSlot as Slot
from gen_data.core.asset_types import Material
from gen_data.core.variant_rng import VariantRng, in_turn

_TAXIS = read_models(
    (
        "executive 2010s, sedan 2010s, estate 2010s, mpv 2010s, box_mpv 2020s",
        "hatchback 2020s, sedan 2000s, suv 2020s",
    )
)
_POLICE = read_models(("estate 2010s, sedan 2010s, suv 2020s, hatchback 2020s, mpv 2010s",))
_PATROLS = ("police_check", "police_blue", "police_dark")
_AMBULANCES = ("ambulance_check", "ambulance_red", "ambulance_blue")
_CARRIERS = ("post_yellow", "parcel_brown", "post_red", "parcel_blue")
_FOODS = ("snacks", "coffee", "ices")


def taxi(rng: VariantRng, steer_deg: float) -> Solid:
    """A taxi with its sign on the roof, in colours of one of several countries."""
    design = _without_roof_load(cars.draw_car(*in_turn(_TAXIS, rng.seed), rng))
    paint, sign = (hex_to_linear(code) for code in in_turn(COLORS["taxis"], rng.seed).split())
    finish = materials(rng, paint, printed=Print(fixed=True, sign=sign))
    middle, top = _roof_m(design, 0.35), design.height_m
    parts = (
        block((middle - 0.06, -0.2, top - 0.03), (middle + 0.06, 0.2, top + 0.02), 0.0, Slot.TRIM),
        block((middle - 0.05, -0.18, top + 0.015), (middle + 0.05, 0.18, top + 0.14), 0.02,
              Slot.ROOF_SIGN),
    )  # fmt: skip
    return bodywork.make_vehicle(design, steer_deg, finish, bodywork.Additions(parts=parts))


def police_car(rng: VariantRng, steer_deg: float) -> Solid:
    """A police car with a light bar."""
    design = _without_roof_load(cars.draw_car(*in_turn(_POLICE, rng.seed), rng))
    kind = in_turn(_PATROLS, rng.seed)
    finish = _printed(kind, rng.seed, rng)
    image = (
        (design.seams[0] - 0.1, design.seams[-1] + 0.1),
        (design.clearance_m + 0.2, design.belt_m - 0.1),
    )
    additions = bodywork.Additions(image, tuple(_light_bar(design, _roof_m(design, 0.3))))
    return bodywork.make_vehicle(replace(design, strip=False), steer_deg, finish, additions)


def ambulance(rng: VariantRng, steer_deg: float) -> Solid:
    """A van of an ambulance service with light bars in front and behind."""
    design = _closed_van("high_roof", rng)
    bars = (*_light_bar(design, _roof_m(design, 0.03)), *_light_bar(design, _roof_m(design, 0.93)))
    return _service_van(design, in_turn(_AMBULANCES, rng.seed), rng.seed, rng, steer_deg, bars)


def delivery_van(rng: VariantRng, steer_deg: float) -> Solid:
    """A van of a post or parcel service."""
    body = in_turn(("panel_van", "high_roof", "compact_van", "high_roof", "panel_van"), rng.seed)
    return _service_van(
        _closed_van(body, rng), in_turn(_CARRIERS, rng.seed), rng.seed, rng, steer_deg, ()
    )


def food_truck(rng: VariantRng, steer_deg: float) -> Solid:
    """A van with a sales hatch and an awning on its right side."""
    design = _closed_van("high_roof", rng)
    front, rear = design.x(0.5), design.x(0.86)
    y, high = -design.half_m, 0.86 * design.height_m
    parts = (
        block((rear, y - 0.03, 1.15), (front, y + 0.2, high - 0.08), 0.0, Slot.INTERIOR),
        block((rear - 0.03, y - 0.3, 1.1), (front + 0.03, y + 0.05, 1.15), 0.0, Slot.CHROME),
        block((rear - 0.03, y - 0.75, high), (front + 0.03, y + 0.1, high + 0.05), 0.0,
              Slot.SECOND_PAINT),
        *(
            tube([(x, y - 0.02, high - 0.4), (x, y - 0.6, high)], 0.012, 4).painted(Slot.CHROME)
            for x in (rear, front)
        ),
    )  # fmt: skip
    return _service_van(design, in_turn(_FOODS, rng.seed), rng.seed, rng, steer_deg, parts)


def _service_van(
    design: Design,
    kind: str,
    seed: int,
    rng: VariantRng,
    steer_deg: float,
    parts: tuple[Patch, ...],
) -> Solid:
    additions = bodywork.Additions(cars.van_image_m(design), parts)
    return bodywork.make_vehicle(design, steer_deg, _printed(kind, seed, rng), additions)


def _printed(kind: str, seed: int, rng: VariantRng) -> tuple[Material, ...]:
    second = hex_to_linear(rng.choose(COLORS["awnings"]))
    printed = Print(liveries.livery_id(kind, seed), fixed=True)
    return materials(rng, liveries.livery_ground(kind, seed), second, printed=printed)


def _closed_van(body: str, rng: VariantRng) -> Design:
    design = cars.draw_van(body, rng.choose(("2010s", "2020s", "2000s")), rng)
    return replace(design, strip=False, extras=())


def _without_roof_load(design: Design) -> Design:
    kept = tuple(word for word in design.extras if word not in ("roof_box", "roof_bars"))
    return replace(design, extras=kept)


def _roof_m(design: Design, share: float) -> float:
    """The x at a share of the roof from its front."""
    return design.x(design.header + share * (design.roof_end - design.header))


def _light_bar(design: Design, x_m: float) -> list[Patch]:
    half, top = 0.78 * design.roof_share * design.half_m, design.height_m
    lens: tuple[Point2, ...] = ((-half, -0.25 * half), (0.25 * half, half))
    return [
        block((x_m - 0.1, -half, top - 0.03), (x_m + 0.1, half, top + 0.03), 0.0, Slot.TRIM),
        block((x_m - 0.09, -0.25 * half, top + 0.03), (x_m + 0.09, 0.25 * half, top + 0.09), 0.0,
              Slot.CLEAR_LENS),
        *(
            block((x_m - 0.1, low, top + 0.03), (x_m + 0.1, high, top + 0.1), 0.015,
                  Slot.BLUE_BEACON)
            for low, high in lens
        ),
    ]  # fmt: skip
