"""Everything on wheels: sizes, budgets, frames, slots, keypoints and bytes."""

import math
from collections import Counter

import numpy as np
import pytest
from scipy.stats import chisquare

from gen_data.assets.family import Solid
from gen_data.content.procedural.material_presets import hex_to_linear
from gen_data.content.vehicles import FAMILIES as VEHICLES
from gen_data.content.vehicles.car_design import MODELS
from gen_data.content.vehicles.cars import draw_car
from gen_data.content.vehicles.vehicle_materials import COLORS, draw_paint
from gen_data.core.variant_rng import variant_rng
from tests.every_value import for_every
from tests.scenery.rays import cast
from tests.solids import Array, variant, with_role
from tests.tiers import first_and_all

FAMILIES = {name: family for name, family in VEHICLES.items() if name != "tram"}
"""Vehicles with tyres; test_trams.py is about the others."""

# Length, width without mirrors (from paint and glass), height [m], and triangles.
LIMITS = {
    "car": ((2.5, 5.6), (1.42, 2.02), (1.4, 2.3), 8190),
    "van": ((4.1, 6.6), (1.78, 2.1), (1.78, 2.75), 8200),
    "truck": ((6.5, 10.0), (2.2, 2.6), (2.5, 3.8), 8190),
    "taxi": ((4.2, 5.1), (1.76, 1.97), (1.5, 2.0), 8450),
    "police_car": ((4.2, 4.9), (1.76, 1.97), (1.5, 2.0), 8900),
    "ambulance": ((5.6, 6.5), (1.95, 2.1), (2.55, 2.85), 8900),
    "delivery_van": ((4.1, 6.6), (1.78, 2.1), (1.78, 2.75), 8900),
    "food_truck": ((5.6, 6.5), (1.95, 2.1), (2.5, 2.75), 8900),
    "fire_engine": ((7.1, 8.6), (2.2, 2.6), (2.7, 3.5), 8190),
    "tractor": ((4.0, 5.0), (2.3, 2.55), (2.7, 3.1), 6000),
    "bus": ((11.0, 12.4), (2.5, 2.6), (2.95, 3.25), 8190),
    "motorcycle": ((1.7, 2.2), (0.2, 0.6), (1.0, 1.8), 7150),
    "bicycle": ((1.6, 1.9), (0.05, 0.3), (0.9, 1.2), 4000),
    "cyclist": ((1.6, 1.9), (0.05, 0.3), (1.6, 1.95), 4000),
}
FROM_CARS = ("car", "van", "taxi", "police_car", "ambulance", "delivery_van", "food_truck")
FOUR_WHEELED = (*FROM_CARS, "truck", "fire_engine", "tractor", "bus")
LAMPS = {"headlight", "taillight"}
ROLES = {
    *LAMPS, "paint", "glass", "tyre", "rim", "brakelight", "indicator_left", "indicator_right",
    "plate", "trim", "underbody",
}  # fmt: skip


def _few(name: str) -> int:
    """Number of first variants to look at: services share the shells of cars and vans."""
    return 5 if name in ("car", "truck") else 2 if name in FROM_CARS[2:] else 3


for_every_variant = for_every(
    [(name, seed) for name in FAMILIES for seed in range(_few(name))],
    lambda key: (key[0], variant(*key)),
)
"""The first variants of every family."""


@first_and_all
@pytest.mark.parametrize("name", FAMILIES)
def test_every_variant_is_as_big_as_real_ones_and_in_budget(name: str, how_many: str) -> None:
    """The first two, or a dozen of the seeds that are offered for selection."""
    lengths, widths, heights, triangles = LIMITS[name]
    variants = FAMILIES[name].variants
    for seed in range(2) if how_many == "first" else range(0, variants, 1 + variants // 12):
        built = variant(name, seed)
        mesh = built.mesh
        # Antennas are outside the body.
        low, high = built.body_bounds_m or mesh.bounds_m()
        painted = with_role(mesh, "paint")
        side = np.abs(painted[..., 1])
        # Mirror housings are painted too: the width is measured at the body's middle.
        body = side[np.abs(painted[..., 0]) < 0.1 * (high[0] - low[0])]
        assert lengths[0] <= high[0] - low[0] <= lengths[1], seed
        assert heights[0] <= high[2] <= heights[1], seed
        if name in FOUR_WHEELED and name not in ("truck", "fire_engine", "tractor"):
            assert widths[0] <= 2.0 * np.quantile(body, 0.97) <= widths[1], seed
        assert 1000 <= len(mesh.faces) <= triangles, seed


@pytest.mark.slow
@for_every_variant
def test_tyres_touch_the_ground_and_nothing_reaches_below(built: tuple[str, Solid]) -> None:
    mesh = built[1].mesh

    assert mesh.vertices_m[:, 2].min() == pytest.approx(0.0, abs=1e-4)
    assert with_role(mesh, "tyre")[..., 2].min() == pytest.approx(0.0, abs=1e-4)
    others = {m.role for m in mesh.materials} - {"tyre"}
    assert with_role(mesh, *others)[..., 2].min() > 0.015


@for_every_variant
def test_the_origin_is_the_middle_of_the_footprint(built: tuple[str, Solid]) -> None:
    low, high = built[1].mesh.bounds_m()

    assert abs(low[0] + high[0]) < 0.2
    if built[0] != "food_truck":
        assert abs(low[1] + high[1]) < 0.15


@for_every_variant
def test_wheel_keypoints_are_the_middles_of_the_tyres(built: tuple[str, Solid]) -> None:
    name, solid = built
    tyres = with_role(solid.mesh, "tyre").reshape(-1, 3)
    wheels = [point for point in solid.keypoints if point.name.startswith("wheel")]

    assert len(wheels) == (4 if name in FOUR_WHEELED else 2)
    for wheel in wheels:
        at = np.array(wheel.position_m)
        mine = tyres[np.hypot(tyres[:, 0] - at[0], tyres[:, 2] - at[2]) < 1.05 * at[2]]
        mine = mine[mine[:, 1] * at[1] >= -1e-9]
        middle = 0.5 * (mine.min(axis=0) + mine.max(axis=0))
        assert middle[[0, 2]] == pytest.approx(at[[0, 2]], abs=0.01)
        assert mine[:, 1].min() - 1e-3 <= at[1] <= mine[:, 1].max() + 1e-3


@for_every_variant
def test_keypoints_are_named_in_the_vocabulary(built: tuple[str, Solid]) -> None:
    name, solid = built
    points = {point.name: np.array(point.position_m) for point in solid.keypoints}
    if name in FOUR_WHEELED:
        parts = ("wheel_front", "wheel_rear", "headlight", "taillight")
        assert set(points) == {f"{part}_{side}" for part in parts for side in ("left", "right")}
        for part in parts:
            left, right = points[f"{part}_left"], points[f"{part}_right"]
            assert left == pytest.approx(right * (1, -1, 1))
            assert left[1] > 0.3
        assert points["wheel_front_left"][0] > 0.0 > points["wheel_rear_left"][0]
    else:
        assert set(points) == {"wheel_front", "wheel_rear", "headlight", "taillight"}
        assert points["wheel_front"][0] > 0.0 > points["wheel_rear"][0]


@for_every_variant
def test_lamp_keypoints_lie_at_the_lamps(built: tuple[str, Solid]) -> None:
    """Within a hand's breadth of triangles of the lamp."""
    _, solid = built
    for point in solid.keypoints:
        role = point.name.partition("_")[0]
        if role in LAMPS:
            corners = with_role(solid.mesh, role, "brakelight").reshape(-1, 3)
            away = np.sqrt(((corners - np.array(point.position_m)) ** 2).sum(axis=1))
            assert away.min() < point.radius_m, point.name


@for_every_variant
def test_slots_have_the_roles_that_randomizers_look_for(built: tuple[str, Solid]) -> None:
    """Cars, vans, trucks, buses and motorcycles have all lamps; bicycles have two."""
    name, solid = built
    seed = next(seed for seed in range(_few(name)) if variant(name, seed) is solid)
    roles = {material.role for material in solid.mesh.materials}
    if name in ("bicycle", "cyclist"):
        assert {"paint", "tyre", "rim", "trim", *LAMPS} <= roles
    elif name == "motorcycle":
        assert roles >= ROLES - {"glass"}
    else:
        assert roles >= ROLES
    assert ({"skin", "top", "bottom", "shoes"} <= roles) == (
        FAMILIES[name].facts is not None
        and FAMILIES[name].facts(seed=seed).attributes.get("rider") == "yes"
    )


@for_every_variant
def test_indicators_are_on_their_own_sides(built: tuple[str, Solid]) -> None:
    """The left one has y > 0, in front and behind."""
    name, solid = built
    if name in ("bicycle", "cyclist"):
        return
    for role, sign in (("indicator_left", 1.0), ("indicator_right", -1.0)):
        lens = with_role(solid.mesh, role)
        assert (lens[..., 1] * sign > 0.0).all()
        assert lens[..., 0].max() > 0.3
        assert lens[..., 0].min() < -0.3


@pytest.mark.parametrize("name", ["car", "van"])
def test_shell_and_glass_are_symmetric(name: str) -> None:
    for seed in range(3):
        shell = np.round(with_role(variant(name, seed).mesh, "paint", "glass") * 1e5)
        keys = {tuple(sorted(map(tuple, face))) for face in shell.astype(int).tolist()}
        mirrored = shell * (1.0, -1.0, 1.0)
        twins = {tuple(sorted(map(tuple, face))) for face in mirrored.astype(int).tolist()}
        assert keys == twins


def all_around(turns: int, rises_rad: list[float]) -> Array:
    """Unit vectors [turns * rises, 3] in all directions of the compass, by their elevations."""
    turn, rise = np.meshgrid(np.linspace(0, 2 * math.pi, turns, endpoint=False), rises_rad)
    level = np.cos(rise)
    return np.stack([np.cos(turn) * level, np.sin(turn) * level, np.sin(rise)], -1).reshape(-1, 3)


@pytest.mark.parametrize("name", FOUR_WHEELED)
def test_body_faces_outward_wherever_it_is_seen(name: str) -> None:
    """Rays from all around meet paint, glass and lamps from in front, as do their normals."""
    mesh = variant(name, 1).mesh
    roles = [m.role for m in mesh.materials]
    away = all_around(60, [0.05, 0.3, 0.8])
    low, high = mesh.bounds_m()
    for share in (0.2, 0.5, 0.8):
        target = np.array([low[0] + share * (high[0] - low[0]), 0.0, 0.45 * high[2]])
        _, face, normal = cast(mesh, target + 20.0 * away, -away)
        seen = np.array(
            [f >= 0 and roles[mesh.face_slots[f]] in ("paint", "glass", "headlight") for f in face]
        )
        assert seen.sum() > 60
        assert ((normal * away).sum(axis=1)[seen] > 0.0).all()
        smooth = mesh.normals[mesh.faces[face[seen]]].mean(axis=1)
        assert ((smooth * normal[seen]).sum(axis=1) > 0.5).all()


@pytest.mark.parametrize(("name", "seed"), [("car", 0), ("car", 1), ("car", 37), ("van", 1)])
def test_nothing_inside_sticks_out(name: str, seed: int) -> None:
    """Rays from all around meet panes, paint or trim before seats, linings and floor."""
    mesh = variant(name, seed).mesh
    roles = [m.role for m in mesh.materials]
    away = all_around(40, [0.05, 0.4])
    low, high = mesh.bounds_m()
    met = []
    for share in np.linspace(0.06, 0.94, 9):
        for height in (0.5, 0.62, 0.75):
            target = np.array([low[0] + share * (high[0] - low[0]), 0.0, height * high[2]])
            _, face, _ = cast(mesh, target + 20.0 * away, -away)
            met += [roles[mesh.face_slots[f]] for f in face if f >= 0]

    assert met.count("glass") > 100
    assert "interior" in roles
    assert "interior" not in met


@for_every_variant
def test_collision_is_a_few_boxes_around_the_body(built: tuple[str, Solid]) -> None:
    """At most three parts that cover the mesh but for mirrors and handlebars."""
    solid = built[1]
    hull = np.concatenate(solid.collision.parts_m)
    low, high = solid.mesh.bounds_m()

    assert 2 <= len(solid.collision.parts_m) <= 3
    aside = 0.8 if built[0] == "food_truck" else 0.25
    assert hull.min(axis=0) == pytest.approx(low, abs=aside)
    assert hull.max(axis=0) == pytest.approx(high, abs=0.45)


@pytest.mark.parametrize("name", ["car", "van"])
def test_steering_turns_the_front_wheels_alone(name: str) -> None:
    """To the left: the front of the front wheels moves to +Y, all else stays."""
    straight, turned = variant(name, 2), variant(name, 2, steer_deg=25.0)
    before, after = (with_role(s.mesh, "tyre").reshape(-1, 3) for s in (straight, turned))
    front = straight.keypoints[0].position_m

    def toe(corners: Array) -> float:
        """How much further to the left the left front tyre is in front of its hub than behind."""
        mine = corners[(corners[:, 1] > 0) & (np.abs(corners[:, 0] - front[0]) < front[2] + 0.05)]
        ahead = mine[:, 0] > front[0]
        return float(mine[ahead, 1].mean() - mine[~ahead, 1].mean())

    assert toe(before) == pytest.approx(0.0, abs=0.01)
    assert toe(after) > 0.1
    assert np.array_equal(before[before[:, 0] < 0], after[after[:, 0] < 0])
    assert np.array_equal(with_role(straight.mesh, "paint"), with_role(turned.mesh, "paint"))
    assert straight.keypoints == turned.keypoints


def test_body_styles_are_all_offered_and_told_without_building() -> None:
    facts = FAMILIES["car"].facts
    assert facts is not None
    told = {facts(seed=seed, steer_deg=0.0).subcategory for seed in range(FAMILIES["car"].variants)}

    assert told == {
        "hatchback", "sedan", "estate", "suv", "coupe", "city_car", "kei_car", "mpv", "pickup",
        "convertible", "limousine", "off_roader",
    }  # fmt: skip


def test_paints_have_the_weights_of_their_table() -> None:
    """Chi-squared over 2,000 seeds, at one false alarm in 10,000."""
    rows = [row.split() for row in COLORS["cars"]]
    weights = np.array([float(weight) for weight, _ in rows])
    paints = Counter(draw_paint(variant_rng("test", seed)) for seed in range(2000))
    observed = [paints[hex_to_linear(code)] for _, code in rows]

    assert chisquare(observed, 2000.0 * weights / weights.sum()).pvalue > 1e-4


def test_no_two_cars_are_of_the_same_design() -> None:
    """All variants, told by their design: its measures and parts decide the mesh."""
    designs = [
        draw_car(*MODELS["car"][seed], variant_rng("car", seed))
        for seed in range(FAMILIES["car"].variants)
    ]

    assert len(set(designs)) == len(MODELS["car"]) == FAMILIES["car"].variants >= 120


def test_cars_come_from_segments_as_often_as_cars_in_use() -> None:
    """Within a factor of two of the stock of Germany on 1 January 2015 (Kraftfahrt-Bundesamt).

    Minis and small cars, of which southern Europe has more, are within that factor, too.
    """
    stock = {  # per cent
        ("city_car", "kei_car", "micro_car"): 6.6,
        ("supermini", "three_door"): 19.9,
        ("hatchback", "compact_estate"): 26.4,
        ("sedan", "estate"): 16.3,
        ("executive", "limousine"): 5.4,
        ("small_suv", "suv", "large_suv", "coupe_suv", "off_roader"): 7.2,
        ("coupe", "convertible"): 1.8,
        ("mpv", "box_mpv"): 12.6,
    }
    drawn = [body for body, _ in MODELS["car"]]
    for bodies, share in stock.items():
        found = 100.0 * sum(map(drawn.count, bodies)) / len(drawn)
        assert 0.5 < found / share < 2.0, bodies


def test_cars_are_about_as_big_as_those_that_annotators_of_scans_measured() -> None:
    """Mean sizes of KITTI's cars (Frustum PointNets, CVPR 2018): within 8 %, and not of one size.

    Shortest and longest: a two-seater of 2.69 m, a limousine of 5.26 m.
    """
    designs = [
        draw_car(*MODELS["car"][k], variant_rng("car", k)) for k in range(len(MODELS["car"]))
    ]
    sizes_m = np.array([(d.length_m, d.width_m, d.height_m) for d in designs])

    np.testing.assert_allclose(sizes_m.mean(axis=0), (3.883, 1.629, 1.526), rtol=0.08)
    assert sizes_m[:, 0].min() == pytest.approx(2.69, rel=0.05)
    assert sizes_m[:, 0].max() == pytest.approx(5.26, rel=0.05)


@pytest.mark.parametrize(
    ("body", "lengths_m", "widths_m"),
    [("city_car", (3.3, 3.75), (1.5, 1.7)), ("hatchback", (3.9, 4.5), (1.62, 1.86)),
     ("sedan", (4.3, 4.9), (1.68, 1.9)), ("large_suv", (4.7, 5.1), (1.87, 2.0)),
     ("kei_car", (3.3, 3.6), (1.43, 1.54)), ("pickup", (5.0, 5.6), (1.78, 1.93)),
     ("limousine", (5.0, 5.5), (1.85, 1.95)), ("micro_car", (2.5, 2.8), (1.5, 1.7)),
     ("supermini", (3.6, 4.15), (1.56, 1.78))],
)  # fmt: skip
def test_cars_of_a_class_are_as_big_as_real_ones(
    body: str, lengths_m: tuple[float, float], widths_m: tuple[float, float]
) -> None:
    """Every car of the class, by its design."""
    for seed, (kind, era) in enumerate(MODELS["car"]):
        if kind == body:
            design = draw_car(kind, era, variant_rng("car", seed))
            assert lengths_m[0] <= design.length_m <= lengths_m[1], seed
            assert widths_m[0] <= design.width_m <= widths_m[1], seed


def test_service_vehicles_keep_their_colours() -> None:
    """Randomizers leave printed materials alone: paint, livery and roof sign."""
    for name, roles in (("taxi", {"paint", "sign_box"}), ("ambulance", {"paint"})):
        slots = variant(name, 0).mesh.materials
        assert all(m.printed for m in slots if m.role in roles), name
    assert not any(m.printed for m in variant("car", 0).mesh.materials if m.role == "paint")
    assert any("kind=ambulance" in m.texture for m in variant("ambulance", 0).mesh.materials)


def test_text_on_the_sides_reads_from_left_to_right() -> None:
    """On the left u grows to the rear, on the right to the front."""
    mesh = variant("delivery_van", 0).mesh
    slot = next(k for k, m in enumerate(mesh.materials) if "livery" in m.texture)
    faces = mesh.faces[mesh.face_slots == slot].ravel()
    for sign in (1.0, -1.0):
        corners = faces[mesh.vertices_m[faces, 1] * sign > 0.5]
        u, x = mesh.uvs[corners, 0], mesh.vertices_m[corners, 0]
        assert np.corrcoef(x, u)[0, 1] * sign < -0.99
        assert u.min() >= -1e-3
        assert u.max() <= 1.001


MIRROR_M = {
    **dict.fromkeys(FROM_CARS, 0.25), "truck": 0.2, "fire_engine": 0.2, "bus": 0.3, "tractor": 0.3,
}  # fmt: skip
"""Width of both mirrors next to the body: at least this [m]."""


@pytest.mark.parametrize("name", FAMILIES)
def test_the_body_is_as_wide_as_registered_and_leaves_out_mirrors_only(name: str) -> None:
    """Regulation (EU) 1230/2012 measures widths without mirrors; bicycles have none."""
    for seed in range(_few(name)):
        built = variant(name, seed)
        low, high = (np.array(edge) for edge in built.mesh.bounds_m())
        if name in ("bicycle", "cyclist"):
            assert built.body_bounds_m is None
            continue
        assert built.body_bounds_m is not None
        body_low, body_high = (np.array(edge) for edge in built.body_bounds_m)
        assert (body_low >= low).all() and (body_high <= high).all()
        if name not in FOUR_WHEELED:
            # Handlebars are wider than the mirrors above them; riders are higher.
            assert body_low[1] == low[1] and body_high[1] == high[1]
            continue
        if name == "food_truck":
            # Its awning reaches further than the mirrors.
            assert body_low[1] < -1.5
            continue
        width = body_high[1] - body_low[1]
        # Door handles stand out by 12 mm a side.
        assert LIMITS[name][1][0] <= width <= LIMITS[name][1][1] + 0.024, seed
        assert (high[1] - low[1]) - width >= MIRROR_M[name], seed
        assert body_low[2] == low[2] and body_low[0] == low[0]
        # Rods of antennas are 0.2 m high.
        assert 0.0 <= high[2] - body_high[2] <= (0.25 if name in FROM_CARS else 0.0)
        # Only mirrors of buses hang in front.
        assert (body_high[0] < high[0]) == (name == "bus")
