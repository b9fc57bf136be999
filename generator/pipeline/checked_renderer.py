"""Checks of a renderer's results, before any sensor works on them.

A NaN does not survive processing: Warp's ``clamp`` and ``min`` make a bound of it, a conversion to
bytes makes it black, and a scanner takes it for no hit. A finished reading does not show it.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gen_data.core import interfaces, serialization
from gen_data.core.capture import Channel, LidarHits, LidarRays, SensorReading
from gen_data.core.errors import SampleError
from gen_data.core.scene import Camera, Lidar, Scene

DISTANCES = frozenset({Channel.Z_DEPTH, Channel.RANGE, Channel.DEPTH_LAYERS})
"""Channels with infinity for nothing."""


@dataclass(frozen=True)
class CheckedRenderer:
    """A renderer whose radiance is finite, and whose distances are not NaN."""

    renderer: interfaces.Renderer

    def render(
        self,
        scene: Scene,
        camera: Camera,
        channels: frozenset[Channel],
        find_tones: interfaces.FindTones | None = None,
    ) -> SensorReading:
        """See ``Renderer.render``.

        Raises:
            SampleError: a value is NaN or infinite; the message names sensor, channel and pixel.
        """
        pose = camera.T_world_camera
        if not all(map(math.isfinite, (*pose.translation_m, *pose.quaternion_wxyz))):
            raise SampleError(f"scene.cameras '{camera.name}': its pose is not rigid: {pose}")
        reading = self.renderer.render(scene, camera, channels, find_tones)
        images = reading.channels
        if Channel.RADIANCE in images:
            _refuse(scene, f"{camera.name}.radiance", ~np.isfinite(images[Channel.RADIANCE]))
        for channel in DISTANCES & images.keys():
            _refuse(scene, f"{camera.name}.{channel.value}", np.isnan(images[channel]))
        return reading

    def scan(self, scene: Scene, lidar: Lidar, beams: LidarRays) -> LidarHits:
        """See ``Renderer.scan``.

        Raises:
            SampleError: a range is NaN, or a reflectance is not finite.
        """
        hits = self.renderer.scan(scene, lidar, beams)
        _refuse(scene, f"{lidar.name}.range_m", np.isnan(hits.range_m))
        _refuse(scene, f"{lidar.name}.reflectance", ~np.isfinite(hits.reflectance))
        return hits


def _refuse(scene: Scene, quantity: str, wrong: NDArray[np.bool_]) -> None:
    """Raise SampleError if any value is wrong; names the field of the scene that is, if one is."""
    if not wrong.any():
        return
    place = np.argwhere(wrong)[0].tolist()
    fact = f"{quantity}: {int(wrong.sum())} values are NaN or infinite, the first at {place}"
    field = serialization.find_not_finite(serialization.to_plain(scene))
    raise SampleError(f"scene.{field}: is NaN or infinite; {fact}" if field else fact)
