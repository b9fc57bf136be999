"""Pseudo-LiDAR: the depth image of a camera as a point cloud.

After Wang et al., "Pseudo-LiDAR from visual depth estimation", CVPR 2019; the depth here is the
true one. Formats that hold laser scans take it like any other cloud.
"""

from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.config.base_model import NAME_PATTERN
from gen_data.core import errors, intrinsics, se3, shutter, streams
from gen_data.core.capture import POINT, Channel, PointCloud
from gen_data.core.interfaces import Modality, Renderer, SensorInfo
from gen_data.core.scene import Lidar, Scene
from gen_data.sensors.mounting import Mounted, add_lidar, find_camera

MODEL = "pseudo_lidar"
"""Model of these scanners in scenes; their points are pixels of a camera."""


class PseudoLidar(Mounted):
    """Points of a camera's depth image: one pixel of each ``stride_px`` x ``stride_px``.

    A point is the depth image's surface there, at the instant of the reading and without noise.
    Its intensity is 0, its ring the row of its pixel among the selected ones.
    The first pixel of each axis is number ``stride_px // 2``.

    Attributes:
        name: Its name in labels and files.
        camera: Name of a camera listed before it, whose depth it takes. Without a rig, points are
            in a frame that moves with that camera and points along its axis.
        offset_m: Origin of the points' frame, from the camera's centre or on the rig: forward,
            left, up. Above the camera by default, like a laser scanner: readers of KITTI's format
            expect the ground below the origin.
        stride_px: Distance between selected pixels, in both axes.
        range_max_m: Points farther away from the camera are left out.
    """

    type: Literal["pseudo_lidar"] = "pseudo_lidar"
    name: str = Field("pseudo_lidar", pattern=NAME_PATTERN)
    camera: str = "color"
    offset_m: se3.Vec3 = (0.0, 0.0, 0.3)
    stride_px: int = Field(8, ge=1, le=256)
    range_max_m: float = Field(120.0, gt=0, le=10_000)

    def count_rays(self, size_px: tuple[int, int]) -> int:
        """Number of pixels of its camera's image, of width and height, that it selects."""
        columns, rows = (len(range(self.stride_px // 2, size, self.stride_px)) for size in size_px)
        return columns * rows

    def describe(self) -> SensorInfo:
        """Describe a laser scanner, as which exporters treat it."""
        return SensorInfo(
            self.name, Modality.LIDAR, rate_hz=self.rate_hz, time_offset_s=self.time_offset_s
        )

    def mount(self, scene: Scene) -> Scene:
        """Add the frame of the points to the scene.

        Raises:
            ConfigError: the scene has no such rig or camera, or no pixel of its image is selected.
        """
        lidar = Lidar(self.name, self.camera, self.T_rig_sensor, model=MODEL)
        image = find_camera(scene, self.name, self.camera).intrinsics
        if self.stride_px > min(image.width_px, image.height_px):
            raise errors.ConfigError(
                f"sensor '{self.name}': stride_px {self.stride_px} is larger than the image of "
                f"camera '{self.camera}', {image.width_px} x {image.height_px} px"
            )
        return add_lidar(scene, self, lidar)

    def capture(
        self, scene: Scene, renderer: Renderer, channels: frozenset[Channel], rng: streams.Rng
    ) -> PointCloud:
        """Capture the points at the scene's instant, row by row of the image."""
        del channels, rng
        lidar, camera = scene.lidar(self.name), scene.camera(self.camera)
        if camera.shutter.open_s > 0.0:
            # A cloud has a single pose: all its rays leave at one instant.
            camera = replace(camera, shutter=shutter.INSTANT)
        # Channels that most cameras have just rendered: a renderer returns them again without work.
        straight = camera.intrinsics.straight
        depth = Channel.Z_DEPTH if straight else Channel.RANGE
        wanted = (depth, Channel.INSTANCE, Channel.CATEGORY)
        images = renderer.render(scene, camera, frozenset(wanted)).channels
        every_nth = slice(self.stride_px // 2, None, self.stride_px)
        distance_m, instances, categories = (
            images[channel][every_nth, every_nth].ravel() for channel in wanted
        )
        coarse = every_nth_pixel(camera.intrinsics, self.stride_px)
        rays = coarse.pixel_rays().reshape(-1, 3)
        range_m = distance_m / rays[:, 2] if straight else distance_m.astype(np.float64)
        hit = np.flatnonzero(range_m <= self.range_max_m)
        p_camera = rays[hit] * range_m[hit, None]
        T_lidar_camera = lidar.T_world_lidar.inverse() @ camera.T_world_camera
        points: NDArray[Any] = np.zeros(len(hit), POINT)
        points["position_m"] = T_lidar_camera.apply(p_camera)
        points["ring"] = hit // coarse.width_px
        points["instance_id"], points["category_id"] = instances[hit], categories[hit]
        points["return_number"] = points["return_count"] = 1
        return PointCloud(self.name, lidar, points, scene.time_s)


def every_nth_pixel(camera: intrinsics.Intrinsics, stride_px: int) -> intrinsics.Intrinsics:
    """Intrinsics whose pixel centres are every n-th one of another camera's, from ``n // 2`` on.

    Its rays are the rays of the selected pixels.
    """
    first = stride_px // 2
    return replace(
        camera,
        width_px=len(range(first, camera.width_px, stride_px)),
        height_px=len(range(first, camera.height_px, stride_px)),
        fx_px=camera.fx_px / stride_px,
        fy_px=camera.fy_px / stride_px,
        cx_px=(camera.cx_px - (first + 0.5)) / stride_px + 0.5,
        cy_px=(camera.cy_px - (first + 0.5)) / stride_px + 0.5,
    )
