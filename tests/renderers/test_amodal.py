"""Amodal silhouettes: complete, independent, and consistent with visible pixels."""

import numpy as np
import pytest

from gen_data.core.capture import Channel, SensorReading, Silhouette
from gen_data.core.scene import Body, Camera, Instance, Scene
from gen_data.core.se3 import SE3
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.settings import RenderSettings
from tests.renderers.fake_library import (
    FakeLibrary,
    box_mesh,
    forward_camera,
    scattered_pose,
    sphere_mesh,
)

MESHES = {"box": box_mesh(), "ball": sphere_mesh(0.5, rings=24)}
WANTED = frozenset({Channel.INSTANCE, Channel.AMODAL})


def rendered(scene: Scene, camera: Camera, visibility: str = "raster") -> SensorReading:
    settings = RenderSettings(visibility=visibility)
    return WarpRenderer(FakeLibrary(MESHES), "cpu", settings).render(scene, camera, WANTED)


def scene_of(*bodies: Body) -> Scene:
    ids = sorted({body.instance_id for body in bodies} - {0})
    instances = tuple(Instance(i, f"i{i}", "thing", 1, "box") for i in ids)
    return Scene("test", bodies, instances)


def on_image(silhouette: Silhouette, camera: Camera) -> np.ndarray:
    """The part of a silhouette inside the image, as a full-size mask."""
    k = camera.intrinsics
    canvas = np.zeros((3 * k.height_px, 3 * k.width_px), np.bool_)
    y, x = silhouette.y_px + k.height_px, silhouette.x_px + k.width_px
    height, width = silhouette.mask.shape
    canvas[y : y + height, x : x + width] = silhouette.mask
    return canvas[k.height_px : 2 * k.height_px, k.width_px : 2 * k.width_px]


def test_a_hidden_box_has_its_whole_silhouette() -> None:
    """The face of a unit box at z = 4 of which the front lies at 3.5: 14 px wide and high."""
    near = Body("near", "box", SE3((0.0, 0.0, 2.0)), 1.5, instance_id=1)
    far = Body("far", "box", SE3((0.0, 0.0, 4.0)), instance_id=2)

    reading = rendered(scene_of(near, far), forward_camera(focal_px=49.0))

    silhouette = reading.silhouettes[2]
    assert not (reading.channels[Channel.INSTANCE] == 2).any()
    assert silhouette.mask.shape == (14, 14)
    assert silhouette.mask.all()
    assert (silhouette.x_px, silhouette.y_px) == (32 - 7, 24 - 7)


def test_a_silhouette_goes_on_beside_the_image() -> None:
    """Half out to the left: the mask begins at a negative column."""
    body = Body("box", "box", SE3((-32 / 49.0 * 2.0, 0.0, 2.5)), instance_id=1)

    reading = rendered(scene_of(body), forward_camera(focal_px=49.0))

    silhouette = reading.silhouettes[1]
    # The front face, at z = 2, is 24.5 px wide around column 0.
    assert silhouette.x_px == -12
    assert silhouette.mask[12].sum() >= 24
    assert (reading.channels[Channel.INSTANCE] == 1).sum() < silhouette.mask.sum()


@pytest.mark.parametrize("visibility", ["raster", "rays"])
def test_what_is_visible_of_an_instance_lies_in_its_silhouette(visibility: str) -> None:
    """For bodies that occlude each other at random, and instances of several bodies."""
    rng = np.random.default_rng(5)
    camera = forward_camera((96, 72), focal_px=70.0)
    bodies = []
    for k in range(24):
        pose = scattered_pose(rng, (-1.5, -1.2, 1.5), (1.5, 1.2, 4.0))
        bodies.append(Body(f"b{k}", ("box", "ball")[k % 2], pose, 0.5, instance_id=k // 2 + 1))

    reading = rendered(scene_of(*bodies), camera, visibility)

    ids = reading.channels[Channel.INSTANCE]
    for instance_id, silhouette in reading.silhouettes.items():
        inside = on_image(silhouette, camera)
        assert not ((ids == instance_id) & ~inside).any()
        assert silhouette.mask[[0, -1]].any(axis=1).all()
        assert silhouette.mask[:, [0, -1]].any(axis=0).all()
    assert sorted(reading.silhouettes) == list(range(1, 13))


def test_silhouettes_end_at_the_camera_and_at_the_canvas_of_three_images() -> None:
    """Of a body behind the camera, no rows and no columns; a box next to it is cut by its plane."""
    behind = Body("behind", "box", SE3((0.0, 0.0, -3.0)), instance_id=1)
    aside = Body("aside", "box", SE3((0.6, 0.0, 0.0)), instance_id=2)

    silhouettes = rendered(scene_of(behind, aside), forward_camera()).silhouettes

    assert silhouettes[1].mask.shape == (0, 0)
    assert silhouettes[2].x_px + silhouettes[2].mask.shape[1] == 128
    assert silhouettes[2].mask.any()
