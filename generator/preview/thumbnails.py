"""Thumbnails of assets."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core.asset_types import Asset
from gen_data.core.capture import Channel
from gen_data.core.interfaces import AssetLibrary, Renderer
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.kinematics import make_link_bodies
from gen_data.core.scene import Articulation, Body, Camera, Environment, Light, Scene
from gen_data.core.se3 import SE3, look_at
from gen_data.core.streams import Streams
from gen_data.preview.overlay import Image
from gen_data.preview.plate_overlay import plate_overlay
from gen_data.sensors.camera.image_pipeline import ImagePipeline, capture_photograph

_HALF_FIELD_RAD = math.radians(15.0)
_AZIMUTH_RAD, _ELEVATION_RAD = math.radians(35.0), math.radians(25.0)
_MARGIN = 1.1


def thumbnail(asset: Asset, library: AssetLibrary, renderer: Renderer, size_px: int) -> Image:
    """Render an asset, uint8 [size_px, size_px, 3]: images as they are, others from the front.

    Raises:
        AssetError: the asset cannot be read.
    """
    if asset.kind == "texture":
        return _fit_in_square(library.texture(asset.asset_id).albedo, size_px)
    if asset.kind == "plate":
        plate = library.plate(asset.asset_id)
        return _fit_in_square(plate_overlay(plate, library.texture(asset.asset_id).albedo), size_px)
    if asset.kind == "environment":
        radiance = library.environment(asset.asset_id)
        shown = np.power(radiance / (1.0 + radiance), 1.0 / 2.2)
        return _fit_in_square((255.0 * shown).astype(np.uint8), size_px)
    return picture_of(_bodies(asset, library), library, renderer, size_px)


def picture_of(
    bodies: tuple[Body, ...], library: AssetLibrary, renderer: Renderer, size_px: int
) -> Image:
    """Render bodies from the front, the left and above, uint8 [size_px, size_px, 3]."""
    scene = Scene(
        "thumbnail",
        bodies,
        lights=(Light("key", "sun", direction=(-0.36, -0.48, -0.8), illuminance_lux=600.0),),
        environment=Environment(luminance_cd_m2=120.0, visible=False),
    )
    camera, channels = _camera(scene, library, size_px), frozenset({Channel.RGB})
    rng = Streams(seed=0, scene=0).rng("thumbnail")
    reading = capture_photograph(scene, renderer, camera, channels, ImagePipeline(), rng)
    return np.asarray(reading.channels[Channel.RGB], np.uint8)


def _bodies(asset: Asset, library: AssetLibrary) -> tuple[Body, ...]:
    """Bodies of an object, or of a robot at its home pose."""
    if asset.kind != "robot":
        return (Body("object", asset.asset_id),)
    robot = library.robot(asset.asset_id)
    return make_link_bodies(Articulation("robot", asset.asset_id, 1, SE3(), robot.home), robot, ())


def _camera(scene: Scene, library: AssetLibrary, size_px: int) -> Camera:
    """Camera that shows all bodies from the front, the left and above."""
    corners = np.concatenate([_corners(body, library) for body in scene.bodies])
    low, high = corners.min(axis=0), corners.max(axis=0)
    x, y, z = (float(v) for v in 0.5 * (low + high))
    radius_m = max(0.5 * math.dist(low, high), 1e-4)
    distance_m = _MARGIN * radius_m / math.sin(_HALF_FIELD_RAD)
    level_m = distance_m * math.cos(_ELEVATION_RAD)
    eye_m = (
        x + level_m * math.cos(_AZIMUTH_RAD),
        y + level_m * math.sin(_AZIMUTH_RAD),
        z + distance_m * math.sin(_ELEVATION_RAD),
    )
    focal_px = 0.5 * size_px / math.tan(_HALF_FIELD_RAD)
    lens = Intrinsics(size_px, size_px, focal_px, focal_px, 0.5 * size_px, 0.5 * size_px)
    return Camera("thumbnail", look_at(eye_m, (x, y, z)), lens, ev100=7.5)


def _corners(body: Body, library: AssetLibrary) -> NDArray[np.float64]:
    """Corners of a body's bounding box in the world [m], [8, 3]."""
    bounds = library.bounds_m(body.asset)
    box = np.array([[bounds[k >> axis & 1][axis] for axis in range(3)] for k in range(8)])
    return body.T_world_body.apply(box)


def _fit_in_square(image: Image, size_px: int) -> Image:
    """Scale an image to fit, in the middle of a grey square."""
    scale = size_px / max(image.shape[:2])
    height, width = (max(1, round(scale * side)) for side in image.shape[:2])
    small = cv2.resize(np.ascontiguousarray(image), (width, height), interpolation=cv2.INTER_AREA)
    square: Image = np.full((size_px, size_px, 3), 24, np.uint8)
    y, x = (size_px - height) // 2, (size_px - width) // 2
    square[y : y + height, x : x + width] = small
    return square
