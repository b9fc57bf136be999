"""Panels: one-sided rectangles and disks, against quadrature over their area."""

import math
from dataclasses import replace

import numpy as np
import pytest
import warp as wp

from gen_data.core import asset_types, se3
from gen_data.core.capture import Channel
from gen_data.core.photometry import add_fixture, fixture_asset, luminance_cd_m2
from gen_data.core.scene import Body, Light, Scene
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.realtime.light_selection import main_lamps
from gen_data.renderers.warp.scene import brdf_albedo_lut, scene_packing
from gen_data.renderers.warp.scene.kernels import analytic_lights, brdf, records
from tests.embree import RayCaster, placed
from tests.renderers.fake_library import DARK, MATTE, FakeLibrary, box_mesh, camera_at, plane_mesh
from tests.renderers.images import SHARP, drawn, seen

RECTANGLE = Light(
    "r", "rectangle", (0.3, -0.2, 1.6), (0.0, -0.6, -0.8), intensity_cd=100.0,
    size_m=(1.2, 0.6), side=(1.0, 0.0, 0.0),
)  # fmt: skip
DISK = Light("d", "disk", (-0.2, 0.1, 1.5), (0.6, 0.0, -0.8), intensity_cd=100.0, radius_m=0.5)
UPRIGHT = replace(RECTANGLE, position_m=(0.9, 0.0, 0.1), direction=(-1.0, 0.0, 0.0), side=(0, 1, 0))
UPRIGHT_DISK = replace(DISK, position_m=(0.9, 0.2, -0.1), direction=(-1.0, 0.0, 0.0))


def points_on(light: Light, n: int) -> tuple[np.ndarray, float]:
    """Points distributed evenly over a panel, shape [n * n, 3], and the area of each."""
    normal = np.asarray(light.direction)
    s = (np.arange(n) + 0.5) / n
    if light.kind == "rectangle":
        along = np.asarray(light.side) * light.size_m[0]
        across = np.cross(normal, light.side) * light.size_m[1]
        u, v = (axis.ravel() - 0.5 for axis in np.meshgrid(s, s))
        area_m2 = light.size_m[0] * light.size_m[1]
    else:
        along = np.cross(normal, (0.0, 1.0, 0.0))
        along = along / np.linalg.norm(along) * light.radius_m
        across = np.cross(normal, along)
        radius, turn = (axis.ravel() for axis in np.meshgrid(np.sqrt(s), 2.0 * np.pi * s))
        u, v = radius * np.cos(turn), radius * np.sin(turn)
        area_m2 = np.pi * light.radius_m**2
    points = np.asarray(light.position_m) + u[:, None] * along + v[:, None] * across
    return points, area_m2 / len(points)


def summed_lux(
    light: Light, p: np.ndarray, n: np.ndarray, free: np.ndarray | None = None
) -> np.ndarray:
    """Illuminance at points p [k, 3] with normals n: L cos cos dA / d^2 over the panel.

    Args:
        light: A rectangle or disk.
        p: Points, world frame.
        n: Unit normals there.
        free: Which of 40 x 40 points of the panel each p sees; all by default.
    """
    q, area_m2 = points_on(light, 40 if free is not None else 150)
    lux = np.zeros(len(p))
    for k in range(len(p)):
        away = q - p[k]
        squared = (away * away).sum(axis=1)
        away = away / np.sqrt(squared)[:, None]
        leaves = np.maximum(-(away @ np.asarray(light.direction)), 0.0)
        arrives = np.maximum(away @ n[k], 0.0)
        seen = 1.0 if free is None else free[k]
        lux[k] = luminance_cd_m2(light) * area_m2 * (leaves * arrives / squared * seen).sum()
    return lux


@wp.kernel(enable_backward=False)
def _at_points(  # noqa: ANN202, PLR0917
    lamps: wp.array(dtype=records.LightRecord),
    table: wp.array(dtype=wp.vec2, ndim=2),
    p: wp.array(dtype=wp.vec3),
    n: wp.array(dtype=wp.vec3),
    v: wp.array(dtype=wp.vec3),
    panel: wp.array(dtype=wp.vec3),
    area_m2: float,
    roughness: float,
    lux: wp.array(dtype=float),
    mirrored: wp.array(dtype=float),
    summed: wp.array(dtype=float),
):
    """Illuminance; reflection of a white metal by one point; the same summed over the panel."""
    i = wp.tid()
    beam = analytic_lights.beam_from(lamps[0], p[i])
    share = analytic_lights.relative_illuminance(lamps[0], beam, p[i], n[i])
    lux[i] = beam.normal_lux[1] * share
    n_v = wp.dot(n[i], v[i])
    s = brdf.make_brdf(table, wp.vec3(1.0, 1.0, 1.0), roughness, 1.0, 0.5, n_v)
    alpha = s.roughness * s.roughness
    ray = n[i] * (2.0 * n_v) - v[i]
    way = analytic_lights.representative_direction(lamps[0], beam, p[i], ray, alpha)
    n_l = wp.max(wp.dot(n[i], way), 1.0e-3)
    wider = analytic_lights.lobe_widening(lamps[0], beam, alpha)
    if share > 0.0:
        lobe = brdf.specular_lobe(s, n[i], v[i], way, n_l, wider)
        mirrored[i] = (
            lobe[1]
            * n_l
            * beam.normal_lux[1]
            * analytic_lights.above_horizon_fraction(lamps[0], beam, n[i])
        )
    total = wp.float32(0.0)
    for k in range(panel.shape[0]):
        to_part = panel[k] - p[i]
        squared = wp.dot(to_part, to_part)
        to_part = to_part / wp.sqrt(squared)
        leaves = -wp.dot(to_part, lamps[0].direction)
        cosine = wp.dot(n[i], to_part)
        if leaves > 0.0 and cosine > 0.0:
            lobe = brdf.specular_lobe(s, n[i], v[i], to_part, cosine, 0.0)
            total += lobe[1] * cosine * leaves / squared
    summed[i] = total * area_m2 * lamps[0].radiance[1]


def at_points(
    light: Light, p: np.ndarray, n: np.ndarray, v: np.ndarray, roughness: float = 0.5
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Results of the kernel: illuminance, reflection, reflection summed over the panel."""
    open_device("cpu")
    q, area_m2 = points_on(light, 60)
    outputs = [wp.zeros(len(p), dtype=float, device="cpu") for _ in range(3)]
    vectors = [wp.array(a.astype(np.float32), dtype=wp.vec3, device="cpu") for a in (p, n, v, q)]
    lamps = wp.array(scene_packing.lamp_records([light]), dtype=records.LightRecord, device="cpu")
    table = wp.array(brdf_albedo_lut.lobe_albedo(), dtype=wp.vec2, device="cpu")
    inputs = [lamps, table, *vectors, area_m2, roughness]
    wp.launch(_at_points, len(p), inputs, outputs, device="cpu")
    lux, mirrored, summed = (output.numpy() for output in outputs)
    return lux, mirrored, summed


def scattered(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Points around the origin below 1 m, and normals of all directions."""
    rng = np.random.default_rng(seed)
    p = rng.uniform((-1.5, -1.5, -1.0), (1.5, 1.5, 0.9), (count, 3))
    n = rng.normal(size=(count, 3))
    return p, n / np.linalg.norm(n, axis=1, keepdims=True)


@pytest.mark.parametrize("light", [RECTANGLE, DISK, UPRIGHT, UPRIGHT_DISK])
def test_a_panel_gives_the_illuminance_of_lamberts_integral(light: Light) -> None:
    """To 0.2 % of the whole panel's, at any point and for any horizon."""
    p, n = scattered(250, 3)
    # Close to the panel quadrature itself is too coarse.
    height = (p - np.asarray(light.position_m)) @ np.asarray(light.direction)
    p, n = p[np.abs(height) > 0.2], n[np.abs(height) > 0.2]

    lux, _, _ = at_points(light, p, n, n)

    expected = summed_lux(light, p, n)
    away = np.asarray(light.position_m) - p
    whole = light.intensity_cd / (away * away).sum(axis=1)
    assert (np.abs(lux - expected) < 0.002 * whole + 1e-4).all()
    assert (expected > 0.0).sum() > 40
    assert (lux[expected == 0.0] < 1e-4 * light.intensity_cd).all()


def test_a_panel_far_away_is_a_point_with_a_cosine() -> None:
    """I cos / d^2 to 0.2 % for a rectangle at 20 to 40 of its radii: no step in between."""
    small = replace(RECTANGLE, size_m=(0.06, 0.08))
    d = np.linspace(0.9, 2.1, 60)
    p = np.asarray(small.position_m) + d[:, None] * (0.0, 0.0, -1.0)
    n = np.tile((0.0, 0.0, 1.0), (60, 1))

    lux, _, _ = at_points(small, p, n, n)

    np.testing.assert_allclose(lux, 100.0 * 0.8 / d**2, rtol=0.002)


@pytest.mark.parametrize("light", [RECTANGLE, DISK])
def test_nothing_is_lit_behind_a_panel(light: Light) -> None:
    behind = np.asarray(light.position_m) - 0.4 * np.asarray(light.direction)
    turned = -np.asarray(light.direction)

    lux, mirrored, _ = at_points(light, behind[None], -turned[None], -turned[None])

    assert lux[0] == 0.0
    assert mirrored[0] == 0.0


@pytest.mark.parametrize("light", [RECTANGLE, DISK])
@pytest.mark.parametrize(
    ("roughness", "bias", "error"),
    [(0.2, 0.2, 0.4), (0.35, 0.2, 0.35), (0.5, 0.1, 0.2), (0.7, 0.15, 0.15), (1.0, 0.03, 0.03)],
)
def test_a_panel_is_mirrored_about_as_brightly_as_its_integral(
    light: Light, roughness: float, bias: float, error: float
) -> None:
    """Representative point of a panel: mean and mean error over views, relative to quadrature."""
    rng = np.random.default_rng(5)
    p = np.concatenate([rng.uniform(-1.2, 1.2, (300, 2)), np.zeros((300, 1))], axis=1)
    polar, turn = rng.uniform(0.0, 1.2, 300), rng.uniform(0.0, 2.0 * np.pi, 300)
    level = np.sin(polar)
    v = np.stack([level * np.cos(turn), level * np.sin(turn), np.cos(polar)], axis=1)
    n = np.tile((0.0, 0.0, 1.0), (300, 1))

    _, mirrored, summed = at_points(light, p, n, v, roughness)

    assert mirrored.sum() / summed.sum() == pytest.approx(1.0, abs=bias)
    assert np.abs(mirrored - summed).mean() / summed.mean() < error


@pytest.mark.slow
def test_a_matte_plane_under_a_ceiling_panel_is_lit_as_by_quadrature() -> None:
    """Whole images, at every pixel: luminance = E rho / pi."""
    panel = replace(RECTANGLE, position_m=(0.0, 0.0, 0.8), direction=(0.0, 0.0, -1.0))
    scene = Scene("t", (Body("p", "plane"),), lights=(panel,), environment=DARK)
    camera = camera_at((0.0, -0.01, 0.7), (0.0, 0.0, 0.0), (40, 30), hfov_deg=100.0)
    library = FakeLibrary({"plane": plane_mesh(20.0, (MATTE,))})

    luminance = drawn(scene, camera, library, SHARP)[..., 1]

    d = camera.T_world_camera.rotate(
        camera.intrinsics.unproject(np.ones((30, 40), np.float32)).reshape(30, 40, 3)
    )
    p = np.asarray(camera.T_world_camera.translation_m) + d * (-0.7 / d[..., 2:])
    n = np.tile((0.0, 0.0, 1.0), (p.shape[0] * p.shape[1], 1))
    expected = summed_lux(panel, p.reshape(-1, 3), n).reshape(30, 40) * 0.5 / math.pi
    np.testing.assert_allclose(luminance, expected, rtol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("light", [
    replace(RECTANGLE, position_m=(0.0, 0.0, 1.6), direction=(0.0, 0.0, -1.0)),
    replace(RECTANGLE, position_m=(-0.8, 0.0, 1.0), direction=(0.8, 0.0, -0.6), side=(0, 1, 0)),
    replace(DISK, position_m=(0.3, -0.6, 1.2), direction=(0.0, 0.6, -0.8)),
], ids=["ceiling", "softbox", "disk"])  # fmt: skip
def test_shadows_of_panels_are_as_soft_as_their_shape_says(light: Light) -> None:
    """A block on a plane, against 1600 Embree rays per point to all parts of the panel.

    The pattern smooths over 5 x 5 lattice points, that is 15 pixels, which are 7 cm here, and takes
    all parts of a panel for equally bright, while the nearer ones give more: hence errors of 5 % of
    the unshaded light, towards the dark.
    """
    library = FakeLibrary({"plane": plane_mesh(20.0, (MATTE,)), "box": box_mesh()})
    block = Body("b", "box", se3.SE3.about_z(0.5, (0.1, 0.1, 0.15)), 0.3)
    scene = Scene("t", (Body("p", "plane"), block), lights=(light,), environment=DARK)
    camera = camera_at((0.0, -0.01, 6.0), (0.0, 0.0, 0.0), (320, 240), hfov_deg=14.0)

    measured = drawn(scene, camera, library, SHARP)[::8, ::8, 1] * math.pi / 0.5

    d = camera.T_world_camera.rotate(
        camera.intrinsics.unproject(np.ones((240, 320), np.float32)).reshape(240, 320, 3)
    )[::8, ::8].reshape(-1, 3)
    p = np.asarray(camera.T_world_camera.translation_m) + d * (-6.0 / d[..., 2:])
    q, _ = points_on(light, 40)
    caster = RayCaster(placed(block, library))
    hidden = caster.is_blocked(p[:, None], q[None] - p[:, None], near=1e-4, far=1.0)
    on_block = np.abs(block.T_world_body.inverse().apply(p)[:, :2]).max(axis=1) < 0.21
    n = np.tile((0.0, 0.0, 1.0), (len(p), 1))
    expected = summed_lux(light, p, n, ~hidden)
    unshaded = summed_lux(light, p, n)
    error = ((measured.reshape(-1) - expected) / unshaded)[~on_block]
    shaded = (expected < 0.9 * unshaded)[~on_block]
    assert shaded.sum() > 50
    assert np.abs(error[shaded]).mean() < 0.06
    assert abs(error[shaded].mean()) < 0.05
    assert np.abs(error[~shaded]).max() < 0.15


def below_a_panel(floor: asset_types.Material) -> tuple[Scene, Light, FakeLibrary]:
    """A floor in the dark, a panel 1 m above it, and meshes with the panel's fixture."""
    light = replace(RECTANGLE, position_m=(0.0, 0.0, 1.0), direction=(0.0, 0.0, -1.0))
    glass = asset_types.Material((0.8, 0.8, 0.8), role="lamp")
    fixture = _fixture_mesh((1.2, 0.6, 0.04), glass)
    library = FakeLibrary({fixture_asset(light): fixture, "plane": plane_mesh(20.0, (floor,))})
    return Scene("t", (Body("p", "plane"),), environment=DARK), light, library


def test_a_panel_is_seen_in_its_fixture_and_labels_do_not_know_it() -> None:
    """As bright as I / A from the front, dark from behind; instance 0; no self-shadow."""
    scene, light, library = below_a_panel(MATTE)
    scene, shown = add_fixture(scene, light, library.materials(fixture_asset(light)))
    scene = replace(scene, lights=(shown,))
    wanted = (Channel.RADIANCE, Channel.INSTANCE, Channel.Z_DEPTH)

    def middle(
        eye_m: se3.Vec3, target_m: se3.Vec3, scene: Scene = scene
    ) -> tuple[float, int, float]:
        camera = camera_at(eye_m, target_m, (24, 18), hfov_deg=20.0)
        channels = seen(scene, camera, library, *wanted, settings=SHARP)
        return (
            float(channels[Channel.RADIANCE][9, 12, 1]),
            int(channels[Channel.INSTANCE][9, 12]),
            float(channels[Channel.Z_DEPTH][9, 12]),
        )

    before, behind = middle((0.0, 0.01, 0.3), (0, 0, 1)), middle((0.0, 0.01, 3.0), (0, 0, 1))
    below = middle((0.9, 0.0, 0.5), (0.0, 0.0, 0.0))
    bare = replace(scene, bodies=scene.bodies[:1], lights=(light,))
    unseen = middle((0.9, 0.0, 0.5), (0.0, 0.0, 0.0), bare)

    assert (before[0], before[1]) == (pytest.approx(100.0 / 0.72, rel=0.02), 0)
    assert before[2] == pytest.approx(0.701, abs=1e-3)
    assert behind[0] == 0.0
    assert below[0] == pytest.approx(unseen[0], rel=1e-5)


def _fixture_mesh(size_m: se3.Vec3, front: asset_types.Material):  # noqa: ANN202
    """A box that stands on z = 0, its lower side in a separate slot."""
    mesh = box_mesh(size_m, (MATTE, front))
    vertices = mesh.vertices_m + np.array([0.0, 0.0, 0.5 * size_m[2]], np.float32)
    low = (vertices[mesh.faces][..., 2] < 1e-6).all(axis=1)
    return replace(mesh, vertices_m=vertices, face_slots=low.astype(np.int32))


def test_of_many_panels_those_that_light_what_is_seen_are_kept() -> None:
    """A panel that faces away contributes nothing; the others rank by their light."""
    down = replace(RECTANGLE, position_m=(0.0, 0.0, 2.0), direction=(0.0, 0.0, -1.0))
    away = replace(down, direction=(0.0, 0.0, 1.0), intensity_cd=1e5)
    far = replace(down, position_m=(0.0, 0.0, 20.0))
    p, n = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])

    kept = main_lamps(scene_packing.lamp_records([away, far, down]), p, n, 2)

    assert kept.tolist() == [1, 2]


@pytest.mark.parametrize("visible", [True, False])
def test_a_mirror_shows_a_panel_once(visible: bool) -> None:
    """As bright as the panel times the metal's 0.9, whether by a reflected ray or by the lobe."""
    scene, light, library = below_a_panel(asset_types.Material((0.9, 0.9, 0.9), 0.08, 1.0))
    if visible:
        scene, light = add_fixture(scene, light, library.materials(fixture_asset(light)))
    scene = replace(scene, lights=(light,))
    camera = camera_at((-0.3, 0.0, 0.8), (0.0, 0.0, 0.0), (48, 36), hfov_deg=8.0)

    luminance = drawn(scene, camera, library, SHARP)[18, 24, 1]

    tolerance = 0.02 if visible else 0.2
    assert luminance == pytest.approx(0.9 * 100.0 / 0.72, rel=tolerance)
