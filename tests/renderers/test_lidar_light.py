"""Reflectance of materials for lasers, and agreement of scanners with cameras."""

import math

import numpy as np
import pytest

from gen_data.core.asset_types import SURFACES, Material
from gen_data.core.capture import Channel, LidarHits, LidarRays
from gen_data.core.scene import Body, Lidar, Scene
from gen_data.core.se3 import SE3
from gen_data.renderers.warp.lidar.infrared_materials import infrared_fields, oren_nayar
from gen_data.renderers.warp.renderer import WarpRenderer
from tests.renderers.fake_library import FakeLibrary, box_mesh, camera_at, plane_mesh, sphere_mesh

MATTE = Material(base_color=(0.4, 0.4, 0.4), roughness=1.0, specular=0.0)


def seen_at(material: Material, angles_deg: list[float]) -> LidarHits:
    """A plane at one metre, at several angles of incidence."""
    angles = np.radians(angles_deg)
    rays = np.stack([np.sin(angles), np.zeros_like(angles), -np.cos(angles)], axis=1)
    library = FakeLibrary({"plane": plane_mesh(400.0, (material,))})
    lidar = Lidar("top", "color", T_world_lidar=SE3((0.0, 0.0, 1.0)))
    scene = Scene("plane", (Body("plane", "plane"),))
    return WarpRenderer(library, "cpu").scan(
        scene, lidar, LidarRays(rays.astype(np.float32), 0.0, 1, 200.0)
    )


def test_a_matte_surface_falls_with_the_cosine_of_incidence() -> None:
    angles_deg = [0.0, 20.0, 45.0, 60.0, 75.0, 85.0]
    echoes = seen_at(MATTE, angles_deg)

    expected = 0.4 * np.cos(np.radians(angles_deg))
    np.testing.assert_allclose(echoes.reflectance[:, 0], expected, rtol=2e-3)


def test_rough_ground_stays_visible_at_grazing_incidence() -> None:
    """Oren and Nayar: ten times Lambert at 88 degrees, nearly the same at normal incidence."""
    asphalt = Material(base_color=(0.05, 0.05, 0.05), roughness=1.0, specular=0.0, role="asphalt")
    square, grazing = seen_at(asphalt, [0.0, 88.0]).reflectance[:, 0]
    even, rim = oren_nayar(0.5)

    assert square == pytest.approx(0.20 * even, rel=1e-3)
    assert grazing > 8 * 0.20 * math.cos(math.radians(88.0))
    assert rim == pytest.approx(0.45 * 0.25 / 0.34)
    assert oren_nayar(0.0) == (1.0, 0.0)


def test_a_glossy_surface_shines_square_on_and_vanishes_aslant() -> None:
    """Glass: hundreds of times matte black at normal incidence, almost nothing at 30 degrees."""
    glass = Material(base_color=(0.02, 0.02, 0.02), roughness=0.05, specular=0.5, role="glass")
    square, aslant = seen_at(glass, [0.0, 30.0]).reflectance[:, 0]

    # pi * D * F / 4 with D = 1 / (pi alpha^2), alpha no less than 0.03.
    assert square == pytest.approx(0.01 + 0.04 / (4 * 0.03**2), rel=0.01)
    assert aslant < 0.02


def test_a_wide_beam_fills_with_a_part_of_the_foliage() -> None:
    """Beyond a few leaves' width the echo of leaves fades to its share; walls keep theirs."""
    ranges_m, divergence_rad = (1.0, 30.0, 1000.0), 2e-3

    def seen(role: str, subrays: int) -> np.ndarray:
        library = FakeLibrary({"plane": plane_mesh(400.0, (Material(role=role),))})
        renderer = WarpRenderer(library, "cpu")
        down = LidarRays(np.float32([[0.0, 0.0, -1.0]]), divergence_rad, subrays, 2000.0)
        scene = Scene("plane", (Body("plane", "plane"),))
        above = (Lidar("top", "color", T_world_lidar=SE3((0.0, 0.0, r))) for r in ranges_m)
        return np.array([renderer.scan(scene, top, down).reflectance[0, 0] for top in above])

    leaves, walls = seen("leaf", 1), seen("facade", 1)

    np.testing.assert_allclose(walls, walls[0], rtol=1e-4)
    width2 = (0.01 + divergence_rad * np.array(ranges_m)) ** 2
    filled = 0.36 + 0.64 * 0.07**2 / (0.07**2 + width2)
    np.testing.assert_allclose(leaves / leaves[0], filled / filled[0], rtol=1e-4)
    assert 0.36 < leaves[2] / leaves[0] < 0.38
    assert seen("leaf", 7)[1] > leaves[1]


def test_signs_are_retro_reflectors() -> None:
    """Hundreds of times white, also at 40 degrees; no retro-reflection at 75."""
    sign = Material(base_color=(0.5, 0.1, 0.1), roughness=0.8, role="sign")
    square, turned, edge = seen_at(sign, [0.0, 40.0, 75.0]).reflectance[:, 0]

    assert square > 700.0
    assert turned > 0.5 * square
    assert edge < 1.0


@pytest.mark.parametrize("role", ["leaf", "skin", "asphalt", "top"])
def test_the_infrared_is_not_what_the_eye_sees(role: str) -> None:
    """A black leaf, face, road or shirt is not black for a laser: roles have a reflectance."""
    even, rim, *_ = infrared_fields(Material(role=role), np.zeros(3))

    assert even + rim > 0.15


def test_black_paint_is_black_to_a_laser_too() -> None:
    """Carbon absorbs the infrared as well."""
    even, rim, *_ = infrared_fields(Material(role="paint"), np.full(3, 0.02))

    assert even == pytest.approx(0.02) and rim == 0.0


def test_colourful_paint_is_brighter_than_grey_of_its_darkness() -> None:
    """Blue pigment lets the infrared pass; white and grey are as they look."""

    def even(*color: float) -> float:
        return infrared_fields(Material(role="paint"), np.array(color))[0]

    assert even(0.01, 0.05, 0.16) > 3.0 * even(0.05, 0.05, 0.05)
    assert even(0.006, 0.017, 0.05) < even(0.01, 0.05, 0.16)
    assert even(0.8, 0.8, 0.8) == pytest.approx(0.8)
    assert even(0.0, 0.0, 0.0) == 0.0


def test_surfaces_are_numbered_by_role() -> None:
    """Roles without a number are 0."""
    for role, number in (("asphalt", SURFACES.index("asphalt")), ("eyes", 0)):
        assert seen_at(Material(role=role), [10.0]).surface[0, 0] == number


def test_camera_and_lidar_see_the_same_world() -> None:
    """On 99 % of the points visible to both, z-depths agree within 5 mm."""
    library = FakeLibrary({"plane": plane_mesh(80.0), "box": box_mesh(), "ball": sphere_mesh(0.7)})
    rng = np.random.default_rng(3)
    bodies = [Body("plane", "plane")]
    for k in range(25):
        place = tuple(float(v) for v in rng.uniform((4, -8, 0.3), (30, 8, 1.5)))
        asset = str(rng.choice(["box", "ball"]))
        bodies.append(Body(f"b{k}", asset, SE3.about_z(float(k), place), 1.5, instance_id=k + 1))
    scene = Scene("street", tuple(bodies))
    camera = camera_at((0.0, 0.0, 1.65), (10.0, 0.0, 1.5), (1242, 375), 81.4)
    renderer = WarpRenderer(library, "cpu")
    reading = renderer.render(scene, camera, frozenset({Channel.Z_DEPTH, Channel.INSTANCE}))
    # At the camera itself nothing is hidden from one and seen by the other; rays through pixels.
    k = camera.intrinsics
    v, u = (a.ravel() + 0.5 for a in np.mgrid[4:370:7, 4:1240:7])
    in_camera = np.stack([(u - k.cx_px) / k.fx_px, (v - k.cy_px) / k.fy_px, np.ones_like(u)], 1)
    rays = in_camera / np.linalg.norm(in_camera, axis=1, keepdims=True)
    lidar = Lidar("top", "camera", T_world_lidar=camera.T_world_camera)

    echoes = renderer.scan(scene, lidar, LidarRays(rays.astype(np.float32), 0.0, 1, 300.0))

    z_m = echoes.range_m[:, 0] * rays[:, 2]
    depth_m = reading.channels[Channel.Z_DEPTH][v.astype(int), u.astype(int)]
    both = np.isfinite(z_m) & np.isfinite(depth_m)
    assert (np.isfinite(z_m) == np.isfinite(depth_m)).mean() > 0.999
    near = np.abs(z_m[both] - depth_m[both]) < np.maximum(5e-3, 1e-4 * depth_m[both])
    assert near.mean() > 0.99
    ids = reading.channels[Channel.INSTANCE][v.astype(int), u.astype(int)]
    assert (ids == echoes.instance_id[:, 0]).mean() > 0.999


def test_what_is_clear_to_the_eye_is_clear_to_a_laser() -> None:
    """Without a role, transmission and opacity decide the passing light; Fresnel the mirrored."""
    white = np.ones(3)
    glass = Material((1, 1, 1), 0.04, transmission=0.75, ior=1.5)
    veil = Material((1, 1, 1), 1.0, opacity=0.25)

    even, _, _, _, _, mirror, clear = infrared_fields(glass, white)
    assert (clear, mirror) == pytest.approx((0.75, 0.04))
    assert even == pytest.approx(0.25)
    even, _, _, _, _, mirror, clear = infrared_fields(veil, white)
    assert (clear, mirror, even) == pytest.approx((0.75, 0.0, 0.25))
    assert infrared_fields(Material(), white)[5:] == (0.0, 0.0)
