"""Objects on photographs, against renderings of the whole scene.

The photograph is a rendering of the same ground without the objects on it.
"""

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gen_data.core import colorimetry, errors, motion, plates
from gen_data.core.asset_types import Asset, Material, TextureData
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.scene import Body, Camera, Instance, Scene, Weather
from gen_data.core.se3 import SE3, look_at
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers.fake_library import FakeLibrary, box_mesh, plane_mesh, uniform_sky

SIZE_PX = (120, 80)
ALBEDO, GREY, SHARE = 0.15, 0.3, 0.8
"""Of the ground; its linear value in the photograph; share of the sun."""
CORNERS = ((5.0, 78.0), (115.0, 78.0), (90.0, 40.0), (30.0, 40.0))
LABELS = frozenset({Channel.INSTANCE, Channel.Z_DEPTH, Channel.RANGE, Channel.NORMALS})
SEEN = LABELS | {Channel.RADIANCE}


def plate(mask: str = "") -> plates.Plate:
    """A camera that looks down by 12 degrees, under a sun and an even sky."""
    down = (1.0, 0.0, 1.6 - math.tan(math.radians(12.0)))
    pose = look_at((0.0, 0.0, 1.6), down, math.radians(1.0)).rounded(9)
    sky = (1.0 - SHARE) * GREY / ALBEDO
    sun = plates.PlateSun(math.radians(60.0), math.radians(50.0), SHARE)
    return plates.Plate(
        SIZE_PX, 110.0, pose, CORNERS, (), (GREY, GREY, GREY), ALBEDO, 1.0, sky, sun, mask
    )


class PlateLibrary(FakeLibrary):
    """Meshes of a scene, and the photograph ``plate/a``."""

    def __init__(self, photo: NDArray[np.uint8], mask: NDArray[np.uint8] | None = None) -> None:
        rng = np.random.default_rng(3)
        stones = rng.integers(90, 190, (16, 16, 3)).astype(np.uint8)
        textures = {"stones": TextureData(stones), "plate/a": TextureData(photo)}
        if mask is not None:
            textures["plate/a#mask.png"] = TextureData(np.repeat(mask[..., None], 3, axis=2))
        meshes = {"ground": plane_mesh(400.0), "cube": box_mesh()}
        super().__init__(meshes, textures, {"plate/a": uniform_sky(32)})
        self._plate = plate("" if mask is None else "mask.png")

    def get(self, asset_id: str) -> Asset:
        kind = "plate" if asset_id == "plate/a" else "environment"
        return Asset(asset_id, kind, "", (), "CC0-1.0", "test", "test", "0")

    def plate(self, asset_id: str) -> plates.Plate:
        assert asset_id == "plate/a"
        return self._plate


def world(*, cube: bool, photo: bool) -> Scene:
    """The ground, as a photograph's or with stones, with or without a cube on it."""
    stones = Material((0.5, 0.5, 0.5), roughness=1.0, texture="stones", texture_scale_m=3.0)
    ground = Body("plate", "ground", materials=(Material(role=plates.CATCHER),))
    camera = plates.fit_camera(Camera("color", SE3(), plate().intrinsics, plates.EV100), plate())
    scene = Scene("test", (ground,), cameras=(camera,))
    scene = plates.show_plate(scene, "plate", "plate/a", plate())
    if not photo:
        scene = replace(scene, bodies=(replace(ground, materials=(stones,)),))
    if not cube:
        return scene
    pose = SE3.about_z(0.6, (5.0, 0.1, 0.5))
    red = Material((0.5, 0.08, 0.06), roughness=0.7)
    thing = Body("cube", "cube", pose, instance_id=1, materials=(red,))
    low, high = (-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)
    labelled = Instance(1, "cube", "cube", 1, "cube", (True), (), pose, low, high)
    return replace(scene, bodies=(*scene.bodies, thing), instances=(labelled,))


def seen(
    library: FakeLibrary, scene: Scene, channels: frozenset[Channel] = SEEN, **settings: Any
) -> SensorReading:
    renderer = WarpRenderer(library, "cpu", RenderSettings(**settings))
    return renderer.render(scene, scene.cameras[0], channels)


def photographed(reading: SensorReading) -> NDArray[np.uint8]:
    """A photograph by a camera with nothing but sRGB's curve."""
    linear = np.clip(
        reading.channels[Channel.RADIANCE].astype(np.float64) / plates.WHITE_CD_M2, 0.0, 1.0
    )
    return np.asarray((255.0 * colorimetry.srgb_encode(linear)).round(), np.uint8)


@cache
def empty_photo() -> NDArray[np.uint8]:
    """The ground with stones, and nothing on it."""
    blank = np.zeros((*SIZE_PX[::-1], 3), np.uint8)
    return photographed(seen(PlateLibrary(blank), world(cube=False, photo=False)))


@cache
def composite() -> SensorReading:
    return seen(PlateLibrary(empty_photo()), world(cube=True, photo=True))


@cache
def whole() -> SensorReading:
    return seen(PlateLibrary(empty_photo()), world(cube=True, photo=False))


def test_a_photograph_without_things_is_shown_as_it_is() -> None:
    """Bytes come back through radiance, to the last one."""
    shown = seen(PlateLibrary(empty_photo()), world(cube=False, photo=True))
    np.testing.assert_array_equal(photographed(shown), empty_photo())


def test_a_cube_on_a_photograph_looks_as_in_the_whole_scene() -> None:
    """Pixels, shadow included, agree within 2 of 255; at most 1 % more, at edges of the shadow."""
    ours, truth = photographed(composite()).astype(int), photographed(whole()).astype(int)
    difference = np.abs(ours - truth).max(axis=-1)
    assert (difference > 2).mean() < 0.01
    assert difference.max() <= 12
    shaded = (truth.sum(axis=-1) < 0.8 * empty_photo().sum(axis=-1, dtype=int)) & (
        whole().channels[Channel.INSTANCE] == 0
    )
    assert shaded.sum() > 100, "the cube throws a shadow on the photograph"
    assert difference[shaded].max() <= 4


def test_things_and_ground_have_labels_and_the_rest_has_none() -> None:
    """Depth of the ground is known inside its corners; instances are as in the whole scene."""
    ours, truth = composite().channels, whole().channels
    np.testing.assert_array_equal(ours[Channel.INSTANCE], truth[Channel.INSTANCE])
    known = np.isfinite(ours[Channel.Z_DEPTH])
    np.testing.assert_array_equal(ours[Channel.Z_DEPTH][known], truth[Channel.Z_DEPTH][known])
    assert known[75, 60], "inside the corners"
    assert not known[75, 1], "ground outside the corners"
    assert not known[2].any(), "above the horizon"
    assert (ours[Channel.NORMALS][~known] == 0.0).all()
    np.testing.assert_array_equal(known, np.isfinite(ours[Channel.RANGE]))


def test_layers_behind_glass_have_labels_where_the_ground_has() -> None:
    """Through two sides of a cube of glass above the ground, this inside its corners."""
    scene = world(cube=True, photo=True)
    glass = Material(transmission=1.0)
    ground, cube = scene.bodies
    pose = SE3.about_z(0.6, (5.0, 0.1, 0.52))
    cube = replace(cube, T_world_body=pose, materials=(glass,))
    scene = replace(scene, bodies=(ground, cube))
    wanted = frozenset({Channel.DEPTH_LAYERS, Channel.INSTANCE_LAYERS}) | LABELS
    library = PlateLibrary(empty_photo(), half_mask())
    images = seen(library, scene, wanted).channels
    depth_m, ids = images[Channel.DEPTH_LAYERS], images[Channel.INSTANCE_LAYERS]
    bare = seen(library, world(cube=False, photo=True), LABELS).channels[Channel.Z_DEPTH]

    np.testing.assert_array_equal(depth_m[..., 0], images[Channel.Z_DEPTH])
    np.testing.assert_array_equal(ids[..., 0], images[Channel.INSTANCE])
    glazed = (ids == [1, 1, 0, 0]).all(axis=-1)
    assert np.isfinite(depth_m[glazed, 2]).any() and np.isinf(depth_m[glazed, 2]).any()
    np.testing.assert_allclose(depth_m[glazed, 2], bare[glazed], rtol=1e-4)
    assert not np.isfinite(depth_m[:, : SIZE_PX[0] // 2]).any(), "the foreground hides all layers"


def test_mirrors_behind_the_foreground_show_nothing() -> None:
    scene = world(cube=True, photo=True)
    silver = Material((0.9, 0.9, 0.9), 0.02, metallic=1.0)
    ground, cube = scene.bodies
    scene = replace(scene, bodies=(ground, replace(cube, materials=(silver,))))
    wanted = frozenset({Channel.MIRRORED_POSITION, Channel.INSTANCE})
    images = seen(PlateLibrary(empty_photo(), half_mask()), scene, wanted).channels
    shown = np.isfinite(images[Channel.MIRRORED_POSITION]).all(axis=-1)
    assert shown.any() and (images[Channel.INSTANCE][shown] == 1).all()
    assert not shown[:, : SIZE_PX[0] // 2].any()
    # All sides of the cube stand on the ground, at height 0.
    assert np.abs(images[Channel.MIRRORED_POSITION][shown][:, 2]).max() < 1e-3


def half_mask() -> NDArray[np.uint8]:
    mask = np.zeros(SIZE_PX[::-1], np.uint8)
    mask[:, : SIZE_PX[0] // 2] = 255
    return mask


def test_the_foreground_hides_exactly() -> None:
    """Behind it are the photograph's pixels and no labels; elsewhere nothing changes."""
    left = slice(0, SIZE_PX[0] // 2)
    right = slice(SIZE_PX[0] // 2, None)
    hidden = seen(
        PlateLibrary(empty_photo(), half_mask()),
        world(cube=True, photo=True),
        SEEN | {Channel.AMODAL},
    )
    assert (composite().channels[Channel.INSTANCE][:, left] == 1).any(), "the cube is behind it"
    np.testing.assert_array_equal(photographed(hidden)[:, left], empty_photo()[:, left])
    assert not hidden.channels[Channel.INSTANCE][:, left].any()
    assert np.isinf(hidden.channels[Channel.Z_DEPTH][:, left]).all()
    for channel in SEEN:
        np.testing.assert_array_equal(
            hidden.channels[channel][:, right], composite().channels[channel][:, right]
        )
    outline = hidden.silhouettes[1].mask.sum()
    visible = (hidden.channels[Channel.INSTANCE] == 1).sum()
    assert visible < 0.75 * outline, "the silhouette has the pixels behind the foreground"


def test_images_of_another_size_show_the_same_part() -> None:
    """The photograph is cropped to the shape of the image, and reduced by averaging."""
    scene = world(cube=False, photo=True)
    camera = scene.cameras[0]
    smaller = replace(camera.intrinsics, width_px=40, height_px=40)
    scene = replace(
        scene, cameras=(plates.fit_camera(replace(camera, intrinsics=smaller), plate()),)
    )
    shown = seen(PlateLibrary(empty_photo()), scene).channels[Channel.RADIANCE] / plates.WHITE_CD_M2
    part = ((empty_photo()[:, 20:100] / 255.0 + 0.055) / 1.055) ** 2.4
    means = part.reshape(40, 2, 40, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(shown, means, atol=2e-3)


def test_a_moving_thing_blurs_on_the_photograph() -> None:
    """The slices of an exposure are composed like images of an instant; flow behind it is 0."""
    scene = world(cube=True, photo=True)
    cube = scene.bodies[1].T_world_body
    knots = tuple(replace(cube, translation_m=(5.0, 0.1 + 0.3 * k, 0.5)) for k in range(5))
    exposed = replace(scene.cameras[0].shutter, exposure_s=0.04)
    scene = replace(
        scene,
        tracks=(motion.Trajectory("cube", 0.1, knots),),
        cameras=(replace(scene.cameras[0], shutter=exposed),),
        time_s=0.1,
    )
    channels = SEEN | {Channel.FLOW_FORWARD}
    reading = seen(PlateLibrary(empty_photo(), half_mask()), scene, channels)
    flow = reading.channels[Channel.FLOW_FORWARD]
    assert (flow[:, : SIZE_PX[0] // 2] == 0.0).all()
    moving = reading.channels[Channel.INSTANCE] == 1
    assert moving.any()
    assert (flow[moving][:, 0] < -1.0).all(), "to the left"
    still = np.abs(photographed(reading).astype(int) - empty_photo()).max(axis=-1) == 0
    assert still[:20].all(), "pixels above the cube stay as they are"
    assert still.mean() > 0.5


def test_what_contradicts_the_photograph_is_refused() -> None:
    """A moved camera, other light and weather, with the randomizers to remove."""
    library, scene = PlateLibrary(empty_photo()), world(cube=True, photo=True)
    moved = replace(scene.cameras[0], T_world_camera=SE3((0.0, 0.0, 2.0)))
    with pytest.raises(errors.SampleError, match="not where the photograph was taken from"):
        seen(library, replace(scene, cameras=(moved,)))
    sky = replace(scene.environment, image="environment/neutral?seed=0")
    with pytest.raises(errors.SampleError, match="other light; remove the randomizers"):
        seen(library, replace(scene, environment=sky))
    with pytest.raises(errors.SampleError, match="has its own; remove the randomizer weather"):
        seen(library, replace(scene, weather=Weather(wetness=0.5)))


def test_the_path_traced_tier_agrees() -> None:
    """Ground far from the cube is the photograph to a byte, its shadow as in the whole scene."""
    given = {"tier": "pathtraced", "samples": 8, "max_bounces": 2}
    library = PlateLibrary(empty_photo())
    reading = seen(library, world(cube=True, photo=True), **given)
    truth = photographed(seen(library, world(cube=True, photo=False), **given)).astype(int)
    ours = photographed(reading).astype(int)
    difference = np.abs(ours - truth).max(axis=-1)
    assert np.median(np.abs(ours - empty_photo()).max(axis=-1)) <= 1
    inside = reading.channels[Channel.INSTANCE] == 1
    assert np.median(difference[inside]) <= 2
    shaded = (truth.sum(axis=-1) < 0.6 * empty_photo().sum(axis=-1, dtype=int)) & ~inside
    assert shaded.sum() > 100
    assert abs((ours - truth)[shaded].mean()) < 3.0
