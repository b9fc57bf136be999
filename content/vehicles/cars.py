"""Private cars of twenty-one kinds and five decades, delivery vans and minibuses."""

from dataclasses import replace

from gen_data.assets.family import Facts, Solid
from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.content.procedural.surface_shapes import Point2
from gen_data.content.vehicles.bodywork import Additions, make_vehicle
from gen_data.content.vehicles.car_design import DESIGNS, ERAS, MODELS, Design
from gen_data.content.vehicles.liveries import livery_ground, livery_id
from gen_data.content.vehicles.vehicle_materials import COLORS, PLAIN, Print, draw_paint, materials
from gen_data.core.variant_rng import VariantRng, in_turn

CARS, VANS = MODELS["car"], MODELS["van"]
SUBCATEGORIES = {
    "micro_car": "city_car",
    "supermini": "hatchback",
    "three_door": "hatchback",
    "compact_estate": "estate",
    "executive": "sedan",
    "small_suv": "suv",
    "large_suv": "suv",
    "coupe_suv": "suv",
    "box_mpv": "mpv",
    "high_minibus": "minibus",
}
"""Body styles of designs that are not named after theirs."""
_VAN_FACES = {"1990s": ("van_wide",), "2000s": ("van_wide", "van_tall"),
              "2010s": ("van_tall", "van_slim"), "2020s": ("van_slim",)}  # fmt: skip
_ESTATES = ("estate", "compact_estate", "suv", "large_suv", "mpv", "box_mpv")


def car(rng: VariantRng, steer_deg: float) -> Solid:
    """A car. Slots and keypoints as for all vehicles; positive steering turns to the left."""
    design = draw_car(*in_turn(CARS, rng.seed), rng)
    return make_vehicle(design, steer_deg, materials(rng, draw_paint(rng)))


def van(rng: VariantRng, steer_deg: float) -> Solid:
    """A van. Slots and keypoints as for all vehicles; positive steering turns to the left.

    Two of five panel vans carry the livery of a trade.
    """
    design = draw_van(*in_turn(VANS, rng.seed), rng)
    draw = float(rng.random())
    white, fleet = hex_to_linear("#e6e7e6"), hex_to_linear(rng.choose(COLORS["fleets"]))
    paint = white if draw < 0.55 else (fleet if draw < 0.75 else draw_paint(rng))
    printed, additions = PLAIN, Additions()
    if rng.chance(0.4) and design.windows_to < 0.6:
        printed = Print(livery_id("trade", rng.seed), fixed=True)
        additions = Additions(van_image_m(design))
        paint = livery_ground("trade", rng.seed)
    return make_vehicle(design, steer_deg, materials(rng, paint, printed=printed), additions)


def car_facts(seed: int, **_: object) -> Facts:
    """Its body style."""
    return Facts(subcategory(in_turn(CARS, seed)[0]))


def van_facts(seed: int, **_: object) -> Facts:
    """Its kind."""
    return Facts(subcategory(in_turn(VANS, seed)[0]))


def subcategory(body: str) -> str:
    """Body style in labels of a design."""
    return SUBCATEGORIES.get(body, body)


def van_image_m(design: Design) -> tuple[tuple[float, float], tuple[float, float]]:
    """Where the sides of a van are printed: shares of the length, heights [m]."""
    return (max(design.windows_to, design.seams[1]) + 0.015, 0.975), (
        design.clearance_m + 0.32,
        design.height_m - 0.16,
    )


def draw_car(body: str, era: str, rng: VariantRng) -> Design:
    """A car of a kind and a time, stretched, raised and equipped at random."""
    design, time = DESIGNS[body], ERAS[era]
    long, wide, high = (
        size * (1.0 + rng.between(-share, share))
        for size, share in zip(time.size, (0.03, 0.015, 0.015), strict=True)
    )
    shift, rise = rng.between(-0.012, 0.012), time.belt_m + rng.between(-0.02, 0.02)
    is_long = body in _ESTATES
    words = (
        ("antenna", 0.75 if era < "2010s" else 0.1),
        ("fin", 0.0 if era < "2010s" else 0.75),
        ("roof_box", 0.04 if is_long else 0.01),
        ("roof_bars", 0.06 if is_long else 0.02),
        ("tow_bar", 0.3 if is_long else 0.12),
        ("spoiler", 0.45 if design.roof_end > 0.85 and not design.upright_lamps else 0.0),
        ("exhaust", 0.5 if era < "2020s" else 0.15),
        ("twin_exhaust", 0.12 if era < "2020s" else 0.05),
    )
    extras = tuple(word for word, share in words if rng.chance(share) and not design.soft_top)
    bare = rng.chance(time.bare_bumpers, "bare")
    return replace(
        design,
        length_m=design.length_m * long,
        width_m=design.width_m * wide,
        height_m=max(1.402, design.height_m * high),
        wheelbase_m=design.wheelbase_m * long,
        front_axle_m=design.front_axle_m * long,
        wheel_radius_m=design.wheel_radius_m + time.wheel_m + rng.between(-0.008, 0.008),
        wheel=rng.choose(time.wheels),
        rows=time.rows,
        house_rows=time.house_rows,
        body_ends=_square(design.body_ends, time.ends),
        house_ends=_square(design.house_ends, time.ends),
        roof_share=design.roof_share + time.roof_share,
        nose_m=design.nose_m + rise,
        cowl_m=design.cowl_m + 0.3 * rise,
        belt_m=design.belt_m + 0.5 * rise,
        tail_m=design.tail_m + rise,
        cowl=design.cowl + shift,
        header=design.header + shift,
        roof_end=design.roof_end + rng.between(-0.015, 0.01),
        lamp_m=(design.lamp_m[0] + rise, design.lamp_m[1] + rise),
        face=_draw_face(body, time.faces, rng),
        tail=rng.choose(("pillars", "pillars_red"), "tail")
        if design.upright_lamps
        else rng.choose(time.tails),
        cladding=design.cladding and (body != "coupe_suv" or rng.chance(0.5)),
        rails=design.rails and rng.chance(0.7),
        bare_bumpers=bare,
        strip=rng.chance(time.strips),
        extras=extras,
    )


def draw_van(body: str, era: str, rng: VariantRng) -> Design:
    """A van of a kind and a time, stretched and raised at random."""
    design, time = DESIGNS[body], ERAS[era]
    long, high = 1.0 + rng.between(-0.05, 0.06), 1.0 + rng.between(-0.015, 0.04)
    return replace(
        design,
        length_m=design.length_m * long,
        height_m=design.height_m * high,
        wheelbase_m=design.wheelbase_m * long,
        front_axle_m=design.front_axle_m * long,
        cladding=rng.chance(0.4, "cladding"),
        wheel_radius_m=design.wheel_radius_m + rng.between(-0.01, 0.01),
        wheel=rng.choose(("steel", "steel", "cap", "cap_ten", "five", "seven"), "wheel"),
        rows=time.rows,
        face=rng.choose(_VAN_FACES[era]),
        tail=rng.choose(("pillars", "pillars_red"), "tail"),
        bare_bumpers=rng.chance(0.6, "bare_bumpers"),
        strip=rng.chance(0.5),
        extras=("antenna",) if rng.chance(0.4) else (),
    )


def _square(ends: tuple[Point2, Point2], factor: float) -> tuple[Point2, Point2]:
    """Exponents of a plan times a factor: above 1 its corners are squarer."""
    (a, b), (c, d) = ends
    return (factor * a, factor * b), (factor * c, factor * d)


def _draw_face(body: str, faces: tuple[str, ...], rng: VariantRng) -> str:
    if body == "off_roader":
        return rng.choose(("slots", "split_lamps", "round_pair"))
    return rng.choose(faces)
