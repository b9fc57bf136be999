"""A renderer in numpy that shows every annotated instance as its bounding box, in one colour."""

from collections.abc import Callable, Iterable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.config.base_model import Strict
from gen_data.core.capture import Channel, LidarHits, LidarRays, SensorReading, Silhouette
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetLibrary, FindTones, Renderer, RendererSettings
from gen_data.core.scene import Camera, Instance, Lidar, Scene
from gen_data.core.se3 import SE3

Image = NDArray[Any]


class BoxesPlugin(Strict):
    """Flat boxes instead of meshes.

    Attributes:
        luminance_cd_m2: Luminance of every box; the background is black.
    """

    renderer: Literal["stranger_boxes"] = "stranger_boxes"
    luminance_cd_m2: float = 100.0

    def open(self, assets: AssetLibrary) -> Renderer:
        """Open the renderer; it reads no assets."""
        del assets
        return Boxes(self.luminance_cd_m2)


class Boxes:
    """Renders bounding boxes; keeps no state."""

    def __init__(self, luminance_cd_m2: float) -> None:
        self._luminance = luminance_cd_m2

    def render(
        self,
        scene: Scene,
        camera: Camera,
        channels: frozenset[Channel],
        find_tones: FindTones | None = None,
    ) -> SensorReading:
        """Return the requested channels, from the nearest box on the ray of each pixel.

        Each pixel shows one box: there are no samples to take the mean of.
        """
        del find_tones
        pinhole = camera.intrinsics
        if not pinhole.straight:
            raise ConfigError("renderer 'stranger_boxes': pinholes only")
        columns, rows = np.meshgrid(
            np.arange(pinhole.width_px) + 0.5, np.arange(pinhole.height_px) + 0.5
        )
        rays = _rays(camera, columns, rows)
        hits = _nearest(scene.instances, camera.T_world_camera, rays)
        images = {c: self._image(c, hits, rays) for c in channels - {Channel.AMODAL}}
        outlines = {}
        if Channel.AMODAL in channels:
            outlines = {i.instance_id: _silhouette(i, camera) for i in scene.instances}
        return SensorReading(camera.name, camera, images, outlines, scene.time_s)

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        """Return the nearest box on each beam: white, at normal incidence."""
        hits = _nearest(scene.instances, lidar.T_world_lidar, beams.directions.astype(np.float64))
        range_m = np.where(hits["z"] > beams.range_max_m, np.inf, hits["z"])[:, None]
        there = np.isfinite(range_m)

        def column(values: Image, dtype: str) -> Image:
            return np.repeat(np.where(there, values, 0).astype(dtype), beams.subrays, axis=1)

        ones = np.ones_like(range_m)
        return LidarHits(
            np.repeat(range_m.astype(np.float32), beams.subrays, axis=1),
            column(ones, "f4"),
            column(ones, "f4"),
            column(hits["instance"][:, None], "u2"),
            column(hits["category"][:, None], "u2"),
            column(0 * ones, "u1"),
        )

    def _image(self, channel: Channel, hits: dict[str, Image], rays: Image) -> Image:
        there = hits["instance"] > 0
        length = np.linalg.norm(rays, axis=-1)
        images: dict[Channel, Callable[[], Image]] = {
            Channel.RADIANCE: lambda: (there[..., None] * np.full(3, self._luminance)).astype("f4"),
            Channel.Z_DEPTH: lambda: hits["z"].astype("f4"),
            Channel.RANGE: lambda: (hits["z"] * length).astype("f4"),
            Channel.NORMALS: lambda: hits["normal"].astype("f4"),
            Channel.INSTANCE: lambda: hits["instance"].astype("u2"),
            Channel.PART: lambda: np.zeros(there.shape, "u2"),
            Channel.CATEGORY: lambda: hits["category"].astype("u2"),
            Channel.OBJECT_COORDINATES: lambda: hits["coordinates"].astype("f4"),
        }
        if channel not in images:
            raise ConfigError(f"renderer 'stranger_boxes': makes no channel {channel.value}")
        return images[channel]()


def _rays(camera: Camera, x_px: Image, y_px: Image) -> Image:
    """Rays through image points in the camera frame, with z = 1; shape [..., 3]."""
    lens = camera.intrinsics
    x, y = (x_px - lens.cx_px) / lens.fx_px, (y_px - lens.cy_px) / lens.fy_px
    return np.stack([x, y, np.ones_like(x)], axis=-1)


def _nearest(instances: Iterable[Instance], T_world_eye: SE3, rays: Image) -> dict[str, Image]:
    """Nearest box on each ray; ``z`` in multiples of the ray, inf where nothing is hit."""
    shape = rays.shape[:-1]
    found: dict[str, Image] = {
        "z": np.full(shape, np.inf),
        "instance": np.zeros(shape, int),
        "category": np.zeros(shape, int),
        "normal": np.zeros((*shape, 3)),
        "coordinates": np.zeros((*shape, 3)),
    }
    for instance in instances:
        if not instance.annotated:
            continue
        z, normal, coordinates = _hit(instance, T_world_eye, rays)
        nearer = z < found["z"]
        found["z"][nearer] = z[nearer]
        found["instance"][nearer] = instance.instance_id
        found["category"][nearer] = instance.category_id
        found["normal"][nearer] = normal[nearer]
        found["coordinates"][nearer] = coordinates[nearer]
    return found


def _hit(instance: Instance, T_world_eye: SE3, rays: Image) -> tuple[Image, Image, Image]:
    """Entry points of rays into a box (slab method); normals are in the frame of the eye."""
    T_box_eye = instance.T_world_instance.inverse() @ T_world_eye
    low, high = np.array(instance.box_min_m), np.array(instance.box_max_m)
    eye, directions = np.array(T_box_eye.translation_m), rays @ T_box_eye.rotation().T
    directions = np.where(np.abs(directions) < 1e-12, 1e-12, directions)
    first, second = (low - eye) / directions, (high - eye) / directions
    enters, leaves = np.minimum(first, second), np.maximum(first, second)
    axis, z = enters.argmax(axis=-1), enters.max(axis=-1)
    z = np.where((z <= leaves.min(axis=-1)) & (z > 0.0), z, np.inf)
    normal = -np.sign(directions) * np.eye(3)[axis]
    with np.errstate(invalid="ignore"):
        coordinates = (eye + directions * z[..., None] - low) / np.maximum(high - low, 1e-12)
    return z, normal @ T_box_eye.rotation(), np.clip(np.nan_to_num(coordinates), 0.0, 1.0)


def _silhouette(instance: Instance, camera: Camera) -> Silhouette:
    """Silhouette of one box, on a canvas three images wide and high."""
    width, height = camera.intrinsics.width_px, camera.intrinsics.height_px
    columns, rows = np.meshgrid(
        np.arange(-width, 2 * width) + 0.5, np.arange(-height, 2 * height) + 0.5
    )
    z, _, _ = _hit(instance, camera.T_world_camera, _rays(camera, columns, rows))
    mask = np.isfinite(z)
    if not mask.any():
        return Silhouette(instance.instance_id, 0, 0, np.zeros((0, 0), bool))
    y, x = np.nonzero(mask)
    cut = mask[y.min() : y.max() + 1, x.min() : x.max() + 1]
    return Silhouette(instance.instance_id, int(x.min()) - width, int(y.min()) - height, cut.copy())


PLUGIN: type[RendererSettings] = BoxesPlugin
