"""Holes by texture coverage, against the same mesh with the holes cut out."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gen_data.core.asset_types import Material, MeshData, TextureData
from gen_data.core.capture import Channel, LidarRays
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.lens import Lens
from gen_data.core.scene import Body, Camera, Environment, Instance, Lidar, Light, Scene
from gen_data.core.se3 import SE3, look_at
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.scene import material_packing
from gen_data.renderers.warp.scene.device_assets import remove_fringe
from gen_data.renderers.warp.scene.device_cache import DeviceCache
from gen_data.renderers.warp.scene.kernels import records
from gen_data.renderers.warp.scene.scene_packing import pack_world
from gen_data.renderers.warp.settings import RenderSettings
from tests.embree import RayCaster, placed
from tests.renderers.embree import cast
from tests.renderers.fake_library import DARK, FakeLibrary, camera_at, plane_mesh

STRIPES = 4
TEXELS = 64
GRATE = Material((0.6, 0.2, 0.1), 0.8, texture="grate")
CHANNELS = frozenset(
    {Channel.INSTANCE, Channel.Z_DEPTH, Channel.RANGE, Channel.RADIANCE, Channel.AMODAL}
)


def grate_texture() -> TextureData:
    """Upright stripes: eight opaque texels, eight transparent ones, four times."""
    solid = np.arange(TEXELS) // 8 % 2 == 0
    alpha = np.broadcast_to(np.where(solid, 255, 0), (TEXELS, TEXELS)).astype(np.uint8)
    return TextureData(np.full((TEXELS, TEXELS, 3), 200, np.uint8), alpha=alpha.copy())


def cut_grate() -> MeshData:
    """The same stripes as quads of a square of 1 m in the XY plane, facing +Z."""
    vertices, faces = [], []
    for k in range(STRIPES):
        x0, x1 = 2 * k / 8 - 0.5, (2 * k + 1) / 8 - 0.5
        first = len(vertices)
        vertices += [(x0, -0.5, 0), (x1, -0.5, 0), (x1, 0.5, 0), (x0, 0.5, 0)]
        faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    points = np.array(vertices, np.float32)
    return MeshData(
        points,
        np.array(faces, np.int32),
        np.broadcast_to(np.array([0, 0, 1], np.float32), points.shape).copy(),
        points[:, :2] + 0.5,
        np.zeros(len(faces), np.int32),
        (replace(GRATE, texture="plain"),),
    )


def library() -> FakeLibrary:
    plain = TextureData(np.full((4, 4, 3), 200, np.uint8))
    meshes = {
        "grate": plane_mesh(1.0, (GRATE,)), "cut": cut_grate(),
        "floor": plane_mesh(12.0, (Material((0.5, 0.5, 0.5), 1.0, specular=0.0),)),
    }  # fmt: skip
    return FakeLibrary(meshes, {"grate": grate_texture(), "plain": plain})


def scene_of(asset: str) -> Scene:
    """A grate that stands askew on a floor, in the sun."""
    upright = SE3((0.1, 0.0, 0.7), (math.cos(0.7), math.sin(0.7), 0.0, 0.0))
    bodies = (Body("floor", "floor", instance_id=2), Body("grate", asset, upright, instance_id=1))
    things = (
        Instance(1, "grate", "thing", 1, "grate", box_min_m=(-1, -1, -1), box_max_m=(1, 1, 1)),
        Instance(2, "floor", "thing", 1, "floor", box_min_m=(-6, -6, -1), box_max_m=(6, 6, 1)),
    )
    sun = Light("sun", "sun", direction=(-0.6, 0.4, -0.69), illuminance_lux=5000.0)
    return Scene("t", bodies, things, lights=(sun,), environment=DARK)


PINHOLE = camera_at((0.4, -2.2, 1.4), (0.1, 0.4, 0.4), (240, 180), 50.0, ev100=9.0)
FISHEYE = Camera(
    "camera",
    look_at((0.4, -1.2, 1.2), (0.1, 0.4, 0.4)),
    Intrinsics(200, 160, 90.0, 90.0, 100.0, 80.0, Lens("kannala_brandt", (0.01, 0.0, 0.0, 0.0))),
    9.0,
)


@pytest.mark.parametrize("method", ["raster", "rays"])
def test_labels_behind_holes_are_those_of_what_is_behind(method: str) -> None:
    """Ids and depths match Embree's for geometrically cut stripes on all but 0.3 % of pixels."""
    settings = RenderSettings(visibility=method)
    scene = scene_of("grate")

    reading = WarpRenderer(library(), "cpu", settings).render(scene, PINHOLE, CHANNELS)

    depth_m, ids = cast(scene_of("cut"), library(), PINHOLE)
    assert (ids == 1).sum() > 2000
    assert (reading.channels[Channel.INSTANCE] == ids).mean() > 0.997
    close = np.isclose(reading.channels[Channel.Z_DEPTH], depth_m, rtol=1e-4)
    assert close.mean() > 0.997


@pytest.mark.parametrize("camera", [PINHOLE, FISHEYE])
def test_shadows_light_and_silhouettes_are_those_of_cut_stripes(
    camera: Camera,
) -> None:
    """The same image except single pixels on edges; mean light within half a percent."""
    renderer = WarpRenderer(library(), "cpu", RenderSettings())

    holed = renderer.render(scene_of("grate"), camera, CHANNELS)
    cut = renderer.render(scene_of("cut"), camera, CHANNELS)

    a, b = holed.channels[Channel.RADIANCE], cut.channels[Channel.RADIANCE]
    seen = np.isfinite(cut.channels[Channel.RANGE])
    assert seen.mean() > 0.6
    assert (np.abs(a - b).max(axis=-1) > 0.1 * b[seen].mean()).mean() < 0.02
    assert a[seen].mean() == pytest.approx(b[seen].mean(), rel=5e-3)
    shaded = b[..., 1][seen] < 0.2 * np.quantile(b[..., 1][seen], 0.9)
    assert shaded.mean() > 0.01
    outlines = holed.silhouettes[1], cut.silhouettes[1]
    assert [o.x_px for o in outlines] == pytest.approx([outlines[1].x_px] * 2, abs=1)
    assert outlines[0].mask.sum() == pytest.approx(outlines[1].mask.sum(), rel=0.01)


def test_laser_beams_pass_holes() -> None:
    """Ranges and labels of 20,000 rays match Embree's for the cut stripes on all but 0.3 %."""
    scene, cut = scene_of("grate"), scene_of("cut")
    lidar = Lidar("top", "", T_world_lidar=SE3((0.1, -1.5, 0.9)))
    v = np.random.default_rng(1).normal(size=(20_000, 3)) * (0.4, 0.1, 0.4) + (0.0, 1.0, -0.1)
    rays = (v / np.linalg.norm(v, axis=1, keepdims=True)).astype(np.float32)
    eye_m = lidar.T_world_lidar.translation_m
    hits = RayCaster(*(placed(body, library()) for body in cut.bodies)).cast(eye_m, rays)
    expected_m = np.where(hits.distance < 50.0, hits.distance, np.inf)

    echoes = WarpRenderer(library(), "cpu").scan(scene, lidar, LidarRays(rays, 0.0, 1, 50.0))

    assert (np.isfinite(expected_m)).mean() > 0.3
    same = np.isclose(echoes.range_m[:, 0], expected_m, atol=1e-3)
    assert same.mean() > 0.997
    through = (hits.mesh == 0) & (np.abs(v[:, 0]) < 0.2)
    assert same[through].mean() > 0.99


def test_triplanar_holes_repeat_with_the_texture() -> None:
    """Stripes of 1/8 of a repeat of 0.5 m: half of a wall's pixels show the background."""
    wall = replace(GRATE, texture_scale_m=0.5)
    assets = FakeLibrary({"wall": plane_mesh(2.0, (wall,))}, {"grate": grate_texture()})
    scene = Scene("t", (Body("wall", "wall", instance_id=1),), environment=DARK)
    camera = camera_at((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (160, 40), 60.0)

    reading = WarpRenderer(assets, "cpu").render(scene, camera, frozenset({Channel.INSTANCE}))

    row = reading.channels[Channel.INSTANCE][20]
    assert row.mean() == pytest.approx(0.5, abs=0.05)
    # 2 tan(30 degrees) * 1 m are 18.5 stripes and gaps of 1/16 m.
    assert np.count_nonzero(np.diff(row.astype(int))) in (18, 19)


def test_a_mesh_without_coverage_is_drawn_as_ever() -> None:
    """A texture whose coverage is full everywhere changes no byte of any channel."""
    full = replace(grate_texture(), alpha=np.full((TEXELS, TEXELS), 255, np.uint8))
    plain = replace(full, alpha=None)
    readings = []
    for texture in (full, plain):
        assets = library()
        assets.textures["grate"] = texture
        renderer = WarpRenderer(assets, "cpu", RenderSettings(visibility="rays"))
        readings.append(renderer.render(scene_of("grate"), PINHOLE, CHANNELS).channels)
    for channel in sorted(readings[0]):
        np.testing.assert_array_equal(readings[0][channel], readings[1][channel])


def test_colours_of_holes_do_not_reach_coarser_levels() -> None:
    """A green leaf on a transparent magenta ground: every mean is green."""
    y, x = np.mgrid[:32, :32]
    leaf = (x - 15.5) ** 2 + (y - 15.5) ** 2 < 100
    albedo = np.where(leaf[..., None], (20, 180, 40), (255, 0, 255)).astype(np.uint8)

    filled = remove_fringe(albedo, np.where(leaf, 255, 0).astype(np.uint8))

    np.testing.assert_array_equal(filled[leaf], albedo[leaf])
    np.testing.assert_allclose(filled.reshape(-1, 3), np.broadcast_to((20, 180, 40), (1024, 3)))


def test_an_environment_shines_through_holes() -> None:
    """A grate that is half open shows half of an even sky of 100 cd/m^2."""
    scene = replace(
        scene_of("grate"), bodies=scene_of("grate").bodies[1:], lights=(),
        environment=Environment(luminance_cd_m2=100.0),
    )  # fmt: skip
    camera = camera_at((0.1, -3.0, 0.7), (0.1, 0.0, 0.7), (120, 90), 12.0, ev100=6.0)
    shown = WarpRenderer(library(), "cpu", RenderSettings(antialias=1)).render(
        scene, camera, frozenset({Channel.RADIANCE, Channel.INSTANCE})
    )
    sky = shown.channels[Channel.RADIANCE][shown.channels[Channel.INSTANCE] == 0]
    assert len(sky) == pytest.approx(0.5 * 120 * 90, rel=0.1)
    np.testing.assert_allclose(sky, 100.0, rtol=1e-3)


def test_rays_look_for_holes_only_where_a_body_has_some() -> None:
    """Light passes panes as a whole, and of windows the panes: no other ray looks at them again."""
    glass = Material(transmission=1.0)
    meshes = {
        "floor": plane_mesh(1.0),
        "pane": plane_mesh(1.0, (glass,)),
        "window": plane_mesh(1.0, (glass, Material())),
        "grate": plane_mesh(1.0, (GRATE,)),
    }
    cache = DeviceCache(FakeLibrary(meshes, {"grate": grate_texture()}), open_device("cpu"))

    def flags_of(*names: str) -> int:
        scene = Scene("s", tuple(Body(name, name) for name in names))
        return int(pack_world(scene, PINHOLE, cache).record.cutout_flags)

    holes, clear = int(records.HOLES), int(records.CLEAR)
    assert flags_of() == 0
    assert flags_of("floor") == 0
    assert flags_of("floor", "pane") == 0
    assert flags_of("pane", "window") == clear
    assert flags_of("grate", "floor") == holes
    assert flags_of("pane", "grate") == holes
    assert flags_of("window", "grate") == holes | clear


def test_light_passes_a_body_as_a_whole_if_all_of_its_faces_are_clear() -> None:
    """Bodies of one clear slot, a clear and an opaque one, two clear ones with holes, and none."""
    holes, clear, unshaded = int(records.HOLES), int(records.CLEAR), int(records.UNSHADED)
    slots = np.array([clear, clear, 0, clear | holes, clear], np.int32)
    flags = material_packing.cutout_bodies(slots, np.array([1, 2, 2, 0]))
    assert flags.tolist() == [clear | unshaded, clear, clear | holes | unshaded, 0]
