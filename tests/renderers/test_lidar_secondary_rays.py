"""Laser light through glass, by reflection, on wet ground and on snow."""

import math

import numpy as np
import pytest

from gen_data.core.asset_types import SURFACES, Material
from gen_data.core.capture import LidarHits, LidarRays
from gen_data.core.scene import Body, Instance, Lidar, Scene, Weather
from gen_data.core.se3 import SE3
from gen_data.renderers.warp.lidar.infrared_materials import CLEAR, MIRRORS, oren_nayar
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.sensors.lidar.lidar_detection import received_light
from gen_data.sensors.lidar.scan_pattern import lidar_model
from tests.embree import RayCaster, placed
from tests.renderers.fake_library import (
    FakeLibrary,
    box_mesh,
    plane_mesh,
    room_mesh,
    scattered_pose,
)

GREY = Material((0.4, 0.4, 0.4), 1.0, specular=0.0)
GLASS = Material((0.01, 0.01, 0.01), 0.05, role="glass")
WINDOW = Material((0.01, 0.01, 0.01), 0.05, role="window")
ASPHALT = Material((0.05, 0.05, 0.05), 1.0, specular=0.0, role="asphalt")
LIBRARY = FakeLibrary({
    "wall": box_mesh((0.2, 60.0, 60.0), (GREY,)), "pane": box_mesh((0.006, 60.0, 60.0), (GLASS,)),
    "window": box_mesh((0.2, 60.0, 60.0), (WINDOW,)), "road": plane_mesh(400.0, (ASPHALT,)),
})  # fmt: skip
AHEAD = np.array([[1.0, 0.0, 0.0]], np.float32)


def scan(
    scene: Scene, directions: np.ndarray, height_m: float = 0.0, mirrored: bool = False
) -> LidarHits:
    lidar = Lidar("top", "color", T_world_lidar=SE3((0.0, 0.0, height_m)))
    beams = LidarRays(np.asarray(directions, np.float32), 0.002, 1, 200.0, mirrored=mirrored)
    return WarpRenderer(LIBRARY, "cpu").scan(scene, lidar, beams)


def schlick(f0: float, angle_rad: float) -> float:
    """Fresnel reflectance at an angle of incidence."""
    return f0 + (1.0 - f0) * (1.0 - math.cos(angle_rad)) ** 5


def test_behind_a_pane_a_wall_is_seen_dimmed_on_both_ways() -> None:
    """Its range is undisturbed, its reflectance the wall's times the pane's squared."""
    bodies = (
        Body("pane", "pane", SE3((10.0, 0.0, 0.0)), instance_id=1),
        Body("wall", "wall", SE3((15.1, 0.0, 0.0)), instance_id=2),
    )
    things = tuple(Instance(k, f"i{k}", "thing", k, "") for k in (1, 2))

    echoes = scan(Scene("panes", bodies, things), AHEAD)

    assert echoes.range_m[0, 0] == pytest.approx(9.997, abs=1e-4)
    assert echoes.instance_id[0, 0] == 1
    assert echoes.detours is not None
    (behind,) = np.flatnonzero(echoes.detours.surface != SURFACES.index("mirrored"))
    assert echoes.detours.ray[behind] == 0
    assert echoes.detours.range_m[behind] == pytest.approx(15.0, abs=1e-3)
    assert echoes.detours.instance_id[behind] == 2
    assert echoes.detours.category_id[behind] == 2
    passed = CLEAR["glass"] * (1.0 - MIRRORS["glass"])
    assert echoes.detours.reflectance[behind] == pytest.approx(0.4 * passed**2, rel=1e-3)


def test_two_panes_dim_twice() -> None:
    bodies = tuple(Body(f"p{k}", "pane", SE3((5.0 + k, 0.0, 0.0))) for k in range(2))
    wall = Body("wall", "wall", SE3((15.1, 0.0, 0.0)))

    detours = scan(Scene("panes", (*bodies, wall)), AHEAD).detours

    assert detours is not None
    passed = CLEAR["glass"] * (1.0 - MIRRORS["glass"])
    behind = detours.surface != SURFACES.index("mirrored")
    np.testing.assert_allclose(detours.range_m[behind], 15.0, atol=1e-3)
    np.testing.assert_allclose(detours.reflectance[behind], 0.4 * passed**4, rtol=1e-3)


def test_a_window_mirrors_a_wall_to_a_place_behind_itself() -> None:
    """At 45 degrees: distances add up, Fresnel applies twice, and there is no label."""
    turned = SE3.about_z(math.radians(45.0), (10.0, 0.0, 0.0))
    bodies = (
        Body("window", "window", turned, instance_id=1),
        Body("wall", "wall", SE3.about_z(math.radians(90.0), (10.0, -20.1, 0.0)), instance_id=2),
        Body("other", "wall", SE3.about_z(math.radians(90.0), (10.0, 20.1, 0.0)), instance_id=2),
    )

    echoes = scan(Scene("mirror", bodies), AHEAD)

    detours = echoes.detours
    assert detours is not None and len(detours.ray) == 1
    near_m = 10.0 - 0.1 * math.sqrt(2.0)
    assert echoes.range_m[0, 0] == pytest.approx(near_m, abs=1e-3)
    assert detours.range_m[0] == pytest.approx(near_m + 20.0, abs=5e-3)
    mirrored = schlick(MIRRORS["window"], math.radians(45.0))
    assert detours.reflectance[0] == pytest.approx(0.4 * mirrored**2, rel=1e-3)
    assert detours.instance_id[0] == detours.category_id[0] == 0
    assert detours.surface[0] == SURFACES.index("mirrored")


def test_requested_mirrored_objects_have_their_ids_and_true_places() -> None:
    """A window turned by 45 degrees shows the wall 20 m to the right; the pane shows nothing.

    At first, the ray falls on the pane; its own mirror image of the scanner's side is empty.
    """
    turned = SE3.about_z(math.radians(45.0), (10.0, 0.0, 0.0))
    bodies = (
        Body("pane", "pane", SE3((5.0, 0.0, 0.0)), instance_id=4),
        Body("window", "window", turned, instance_id=1),
        Body("wall", "wall", SE3.about_z(math.radians(90.0), (10.0, -20.1, 0.0)), instance_id=2),
    )
    plain = scan(Scene("mirror", bodies[1:]), AHEAD).detours
    shown = scan(Scene("mirror", bodies[1:]), AHEAD, mirrored=True).detours
    both = scan(Scene("both", bodies), AHEAD, mirrored=True).detours

    assert plain is not None and plain.mirrored_id is None and plain.mirrored_m is None
    assert shown is not None and shown.mirrored_id is not None and shown.mirrored_m is not None
    near_m = 10.0 - 0.1 * math.sqrt(2.0)
    assert shown.mirrored_id.tolist() == [2]
    np.testing.assert_allclose(shown.mirrored_m, [[near_m, -20.0, 0.0]], atol=3e-3)
    np.testing.assert_array_equal(shown.range_m, plain.range_m)
    np.testing.assert_array_equal(shown.instance_id, plain.instance_id)
    # Behind the pane, the window is not mirrored.
    assert both is not None and both.mirrored_id is not None and both.mirrored_m is not None
    assert (both.instance_id.tolist(), both.mirrored_id.tolist()) == ([1], [0])
    assert np.isnan(both.mirrored_m).all()


@pytest.mark.parametrize("seed", [1, 2])
def test_mirrored_objects_agree_with_embree(seed: int) -> None:
    """Rays that windows reflect into a hall of boxes: ids on 99.8 %, places within 3 mm."""
    rng = np.random.default_rng(seed)
    meshes = {
        "hall": room_mesh((40.0, 40.0, 12.0), (GREY,)), "box": box_mesh((1.8, 3.0, 1.5), (GREY,)),
        "window": box_mesh((0.2, 3.0, 3.0), (WINDOW,)),
    }  # fmt: skip
    library = FakeLibrary(meshes)
    bodies = [Body("hall", "hall", SE3((0.0, 0.0, -4.0)), instance_id=1)]
    for k in range(30):
        pose = scattered_pose(rng, (-15, -15, -3), (15, 15, 7))
        if np.linalg.norm(pose.translation_m) >= 4.0:
            bodies.append(Body(f"b{k}", ("window", "box")[k % 2], pose, instance_id=k + 2))
    rays = rng.normal(size=(20_000, 3))
    rays = (rays / np.linalg.norm(rays, axis=1, keepdims=True)).astype(np.float32)
    lidar = Lidar("top", "color", T_world_lidar=SE3())
    beams = LidarRays(rays, 0.0, 1, 200.0, mirrored=True)
    detours = WarpRenderer(library, "cpu").scan(Scene("hall", tuple(bodies)), lidar, beams).detours

    caster = RayCaster(*(placed(body, library) for body in bodies))
    first = caster.cast((0.0, 0.0, 0.0), rays)
    n, d = first.normal, rays.astype(np.float64)
    reflected = d - 2.0 * np.sum(d * n, axis=1, keepdims=True) * n
    at = first.distance[:, None] * d
    second = caster.cast(at + 1e-3 * reflected, reflected)
    ids = np.array([body.instance_id for body in bodies])
    is_window = np.array([body.asset == "window" for body in bodies])[first.mesh]
    assert detours is not None and detours.mirrored_id is not None
    assert detours.mirrored_m is not None
    known, ray = set(np.flatnonzero(is_window).tolist()), detours.ray
    assert len(known) > 500 and len(known ^ set(ray.tolist())) <= 0.002 * len(known)
    expected = at[ray] + (second.distance[ray] + 1e-3)[:, None] * reflected[ray]
    same = detours.mirrored_id == ids[second.mesh[ray]]
    assert same.mean() >= 0.998
    # A ray that grazes a surface meets it far from where one 2 mm apart does.
    flat = np.abs(np.sum(second.normal * reflected, axis=1))[ray] > 0.2
    off_m = np.linalg.norm(detours.mirrored_m - expected, axis=1)[same & flat]
    assert off_m.max() < 0.015 and np.median(off_m) < 3e-3


def test_where_nothing_is_of_glass_there_are_no_detours() -> None:
    bodies = (Body("road", "road"), Body("wall", "wall", SE3((10.0, 0.0, 0.0))))

    assert scan(Scene("street", bodies), AHEAD, 1.0).detours is None


def test_puddles_mirror_what_stands_behind_them() -> None:
    """The wall behind appears as far below the road as it is above; Fresnel of water, twice."""
    down = math.radians(4.0)
    ray = [[math.cos(down), 0.0, -math.sin(down)]]
    bodies = (Body("road", "road"), Body("wall", "wall", SE3((40.1, 0.0, 0.0))))
    flooded = Scene("street", bodies, weather=Weather(puddles=1.0, wetness=1.0))

    detours = scan(flooded, ray, 1.8).detours

    assert detours is not None
    assert detours.range_m[0] == pytest.approx(40.0 / math.cos(down), abs=0.02)
    mirrored = schlick(0.02, math.radians(86.0))
    assert detours.reflectance[0] == pytest.approx(0.4 * math.cos(down) * mirrored**2, rel=0.02)


@pytest.mark.parametrize("down_deg", [5.0, 20.0, 60.0])
def test_wet_asphalt_sends_back_less_and_least_aslant(down_deg: float) -> None:
    """By Lekner and Dorf; a film on half of it reflects its Fresnel share away, both ways."""
    down = math.radians(down_deg)
    ray = [[math.cos(down), 0.0, -math.sin(down)]]
    road = (Body("road", "road"),)

    dry = scan(Scene("street", road), ray, 1.8).reflectance[0, 0]
    wet = scan(Scene("street", road, weather=Weather(wetness=1.0)), ray, 1.8).reflectance[0, 0]

    passes = 1.0 - 0.5 * schlick(0.02, math.radians(90.0 - down_deg))
    assert wet / dry == pytest.approx(lekner_dorf(0.2) * passes**2, rel=0.05)


def mean_fresnel(index: float) -> float:
    """Fresnel reflectance for diffuse light on a surface of a relative index above 1."""
    angle = (np.arange(2000) + 0.5) * (0.5 * math.pi / 2000)
    c, t = np.cos(angle), np.sqrt(1.0 - (np.sin(angle) / index) ** 2)
    s, p = (c - index * t) / (c + index * t), (t - index * c) / (t + index * c)
    return float((0.5 * (s * s + p * p) * 2.0 * np.sin(angle) * c).sum() * 0.5 * math.pi / 2000)


def lekner_dorf(dry: float, water: float = 1.33, stone: float = 1.5) -> float:
    """Wet over dry reflectance below a film of water (Applied Optics 27, 1278, 1988)."""
    absorbed = (1.0 - dry) * (1.0 - mean_fresnel(stone / water)) / (1.0 - mean_fresnel(stone))
    back = 1.0 - (1.0 - mean_fresnel(water)) / water**2
    wet = (1.0 - absorbed) * (1.0 - back) / (1.0 - back * (1.0 - absorbed))
    return wet / dry


def test_ground_is_seen_less_far_in_rain() -> None:
    """By an HDL-64E 1.73 m above the road: half of its pulses return from 43 m, in rain from 15."""
    model = lidar_model("HDL-64E")
    ranges_m = np.arange(5.0, 80.0, 0.5)
    rays = [[math.sqrt(1.0 - (1.8 / r) ** 2), 0.0, -1.8 / r] for r in ranges_m]
    road, seen_m = (Body("road", "road"),), []
    for weather in (Weather(), Weather(wetness=1.0)):
        echo = scan(Scene("street", road, weather=weather), rays, 1.8).reflectance[:, 0]
        light = received_light(echo, ranges_m.astype(np.float32), model)
        seen_m.append(float(ranges_m[light > 1.0].max()))

    assert seen_m == pytest.approx([43.0, 15.0], abs=2.5)


def test_snow_is_bright_in_the_near_infrared() -> None:
    """0.85 at normal incidence, by Lambert, instead of 0.20 of black asphalt."""
    road, ray = (Body("road", "road"),), [[0.0, 0.0, -1.0]]
    snow = Weather(snow_cover=1.0)

    bare = scan(Scene("street", road), ray, 1.8)
    under = scan(Scene("street", road, weather=snow), ray, 1.8)

    assert bare.reflectance[0, 0] == pytest.approx(0.20 * oren_nayar(0.5)[0], rel=1e-3)
    assert under.reflectance[0, 0] == pytest.approx(0.85, rel=0.02)
    assert under.surface[0, 0] == bare.surface[0, 0] == SURFACES.index("asphalt")
