"""The contract of every renderer in the table, and of a third party's.

The world is one of boxes, so that a ray's hit is known in closed form, whatever draws the rest.
"""

import pickle
from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from stranger.renderer import BoxesPlugin

from gen_data.core.capture import Channel, LidarRays, SensorReading
from gen_data.core.interfaces import Renderer, RendererSettings
from gen_data.core.scene import Body, Instance, Lidar, Light, Scene
from gen_data.core.se3 import SE3
from gen_data.core.serialization import canonical_json
from gen_data.renderers import TABLE
from tests.renderers.fake_library import FakeLibrary, box_mesh, camera_at

SETTINGS: Mapping[str, type[RendererSettings]] = {
    **{name: TABLE.load(name) for name in TABLE}, "stranger_boxes": BoxesPlugin,
}  # fmt: skip
each = pytest.mark.parametrize("name", SETTINGS)

ARRAYS = {
    Channel.RADIANCE: ("f4", (3,)), Channel.Z_DEPTH: ("f4", ()), Channel.RANGE: ("f4", ()),
    Channel.NORMALS: ("f4", (3,)), Channel.INSTANCE: ("u2", ()), Channel.PART: ("u2", ()),
    Channel.CATEGORY: ("u2", ()), Channel.OBJECT_COORDINATES: ("f4", (3,)),
}  # fmt: skip
"""Type and last axis of the channels that every renderer makes, as listed at ``Channel``."""
LABELS = frozenset(ARRAYS) - {Channel.RADIANCE}
CHANNELS = frozenset(ARRAYS) | {Channel.AMODAL}
NOTHING = {Channel.Z_DEPTH: np.inf, Channel.RANGE: np.inf}
"""Value where nothing was hit; 0 for every other label."""

WIDTH_PX, HEIGHT_PX = 48, 36
SIZE_M = (0.4, 0.6, 0.8)


@cache
def opened(name: str) -> Renderer:
    return fresh(name)


def fresh(name: str) -> Renderer:
    settings = SETTINGS[name]()
    return settings.open(FakeLibrary({"box": box_mesh(SIZE_M)}))


def box(instance_id: int, pose: SE3) -> tuple[Body, Instance]:
    low, high = (tuple(sign * 0.5 * side for side in SIZE_M) for sign in (-1.0, 1.0))
    name = f"box{instance_id}"
    body = Body(name, "box", pose, instance_id=instance_id)
    label = Instance(instance_id, name, "box", 10 + instance_id, "box", True, (), pose, low, high)
    return body, label


def scene_of(*poses: SE3) -> Scene:
    """Boxes with ids from 1 under a lamp."""
    pairs = [box(k, pose) for k, pose in enumerate(poses, 1)]
    lamp = Light("lamp", "sphere", (-1.0, -1.0, 2.0), intensity_cd=300.0, radius_m=0.1)
    bodies, labels = zip(*pairs, strict=True) if pairs else ((), ())
    return Scene("boxes", bodies=bodies, instances=labels, lights=(lamp,))


SCENE = scene_of(SE3((1.0, 0.1, 0.0)), SE3.about_z(0.5, (1.6, -0.3, 0.1)), SE3((-3.0, 0.0, 0.0)))
"""Two boxes ahead, the first partly before the second; one behind the camera."""
CAMERA = camera_at((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (WIDTH_PX, HEIGHT_PX))


def rendered(
    name: str, scene: Scene = SCENE, channels: frozenset[Channel] = CHANNELS, new: bool = False
) -> SensorReading:
    return (fresh(name) if new else opened(name)).render(scene, CAMERA, channels)


def assert_same(one: SensorReading, other: SensorReading) -> None:
    assert one.channels.keys() == other.channels.keys()
    for channel, image in one.channels.items():
        assert image.tobytes() == other.channels[channel].tobytes(), channel
    assert one.silhouettes.keys() == other.silhouettes.keys()
    for key, silhouette in one.silhouettes.items():
        twin = other.silhouettes[key]
        assert (silhouette.x_px, silhouette.y_px) == (twin.x_px, twin.y_px)
        assert np.array_equal(silhouette.mask, twin.mask)


@each
@pytest.mark.parametrize("channel", ARRAYS)
def test_a_requested_channel_has_the_documented_type(name: str, channel: Channel) -> None:
    """Each channel alone, without other channels or silhouettes."""
    reading = rendered(name, channels=frozenset({channel}))
    dtype, last = ARRAYS[channel]

    assert set(reading.channels) == {channel}
    assert reading.channels[channel].dtype == np.dtype(dtype)
    assert reading.channels[channel].shape == (HEIGHT_PX, WIDTH_PX, *last)
    assert not reading.silhouettes
    assert reading.ev100 is None  # Cameras set it when they develop the radiance.


@each
def test_the_reading_says_who_took_it_and_when(name: str) -> None:
    reading = rendered(name, replace(SCENE, time_s=0.25), frozenset({Channel.INSTANCE}))

    assert (reading.sensor, reading.camera, reading.time_s) == ("camera", CAMERA, 0.25)


@each
def test_an_empty_scene_has_the_documented_value_for_nothing(name: str) -> None:
    """Infinity for distances, zero for every other label, no silhouette."""
    reading = rendered(name, Scene("empty"))

    for channel in LABELS:
        assert (reading.channels[channel] == NOTHING.get(channel, 0)).all(), channel
    assert not reading.silhouettes


@each
def test_labels_at_the_middle_are_those_of_the_first_box(name: str) -> None:
    """Its near face is 1.8 m ahead: 2 m to its middle, 0.2 m less; it faces the camera."""
    images = rendered(name).channels
    row, column = HEIGHT_PX // 2, WIDTH_PX // 2
    x, y, z = CAMERA.intrinsics.pixel_rays()[row, column]
    right_m, down_m = 1.8 * x / z, 1.8 * y / z

    assert images[Channel.INSTANCE][row, column] == 1
    assert images[Channel.CATEGORY][row, column] == 11
    assert images[Channel.PART][row, column] == 0
    assert images[Channel.Z_DEPTH][row, column] == pytest.approx(1.8, abs=1e-5)
    length_m = np.linalg.norm([right_m, down_m, 1.8])
    assert images[Channel.RANGE][row, column] == pytest.approx(length_m, abs=1e-5)
    np.testing.assert_allclose(images[Channel.NORMALS][row, column], [0, 0, -1], atol=1e-5)
    # World axes: the camera looks along +X, so right is -Y and down is -Z; the box is at y = 0.1.
    place = [0.0, (-right_m - 0.1) / 0.6 + 0.5, -down_m / 0.8 + 0.5]
    np.testing.assert_allclose(images[Channel.OBJECT_COORDINATES][row, column], place, atol=1e-4)


@each
def test_silhouettes_are_whole_where_images_show_a_part(name: str) -> None:
    """The second box is partly hidden; the first is not, and its silhouette is its image."""
    reading = rendered(name)
    ids = reading.channels[Channel.INSTANCE]
    first, second = reading.silhouettes[1], reading.silhouettes[2]

    assert first.mask.sum() == (ids == 1).sum()
    assert 0 < (ids == 2).sum() < second.mask.sum()
    for silhouette in (first, second):
        assert silhouette.mask.any(axis=0)[[0, -1]].all()
        assert silhouette.mask.any(axis=1)[[0, -1]].all()


@each
def test_the_same_arguments_give_the_same_bytes_whatever_was_rendered_before(name: str) -> None:
    """By a fresh renderer, and by one that has rendered other scenes and sizes."""
    first = rendered(name, new=True)
    for k in range(3):
        other = replace(CAMERA, intrinsics=replace(CAMERA.intrinsics, width_px=32 + 8 * k))
        opened(name).render(scene_of(SE3((0.5 + k, 0.0, 0.0))), other, CHANNELS)

    assert_same(first, rendered(name))


@each
def test_a_reading_keeps_its_bytes_when_the_next_is_taken(name: str) -> None:
    """It shares no memory with the renderer."""
    first = rendered(name)
    before = {channel: image.tobytes() for channel, image in first.channels.items()}
    rendered(name, scene_of(SE3((0.3, 0.0, 0.0))))

    assert {channel: image.tobytes() for channel, image in first.channels.items()} == before


@each
def test_labels_do_not_depend_on_the_order_of_bodies(name: str) -> None:
    """Nor on the order of instances."""
    turned = replace(SCENE, bodies=SCENE.bodies[::-1], instances=SCENE.instances[::-1])

    assert_same(
        rendered(name, channels=LABELS | {Channel.AMODAL}),
        rendered(name, turned, LABELS | {Channel.AMODAL}),
    )


@each
def test_labels_do_not_depend_on_what_else_is_requested(name: str) -> None:
    """Each alone is what it is among all."""
    every = rendered(name).channels
    for channel in LABELS:
        alone = rendered(name, channels=frozenset({channel})).channels[channel]
        assert alone.tobytes() == every[channel].tobytes(), channel


@each
def test_arguments_stay_as_they_are(name: str) -> None:
    before = canonical_json(SCENE), canonical_json(CAMERA)
    rendered(name)

    assert (canonical_json(SCENE), canonical_json(CAMERA)) == before


@each
def test_settings_travel_to_other_processes(name: str) -> None:
    """Workers get the settings and open renderers of their own."""
    settings = SETTINGS[name]()

    assert pickle.loads(pickle.dumps(settings)) == settings


@each
def test_beams_meet_the_first_surface_in_their_way(name: str) -> None:
    """Ahead 1.8 m, to the side nothing, backwards the box behind, beyond the reach nothing."""
    ahead, side, back = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)
    lidar = Lidar("lidar", "", T_world_lidar=SE3((-1.0, 0.0, 0.0)))
    directions = np.array([ahead, side, back], np.float32)
    found = opened(name).scan(SCENE, lidar, LidarRays(directions, 0.0, 1, 100.0))
    near = opened(name).scan(SCENE, lidar, LidarRays(directions, 0.0, 1, 1.7))

    np.testing.assert_allclose(found.range_m[:, 0], [1.8, np.inf, 1.8], atol=1e-5)
    assert found.instance_id[:, 0].tolist() == [1, 0, 3]
    assert found.category_id[:, 0].tolist() == [11, 0, 13]
    np.testing.assert_allclose(found.incidence_cos[:, 0], [1.0, 0.0, 1.0], atol=1e-5)
    assert (found.reflectance[:, 0] > 0.0).tolist() == [True, False, True]
    types = {"range_m": "f4", "reflectance": "f4", "incidence_cos": "f4"}
    types |= {"instance_id": "u2", "category_id": "u2", "surface": "u1"}
    for field, dtype in types.items():
        assert getattr(found, field).dtype == np.dtype(dtype), field
        assert getattr(found, field).shape == (3, 1), field
    assert np.isinf(near.range_m).all()
