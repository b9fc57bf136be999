"""Camera poses on an orbit around the scene's focus."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field

from gen_data.generator.config import distributions as dist
from gen_data.generator.core.errors import ConfigError, did_you_mean
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Camera, Scene
from gen_data.generator.core.se3 import look_at
from gen_data.generator.core.streams import Rng
from gen_data.randomizers.base import RandomizerBase
from gen_data.randomizers.free_space import is_in_the_open

TRIES = 48


class CameraPose(RandomizerBase):
    """Places cameras on an orbit around the scene's focus, aimed at it.

    Attributes:
        camera: Name of a sensor; empty = every camera that is not on a rig, drawn independently.
        distance_m: Distance to the look-at point.
        azimuth_deg: Angle around the vertical: 0 is on the +X side, 90 on the +Y side.
        elevation_deg: Angle above the horizon.
        jitter_m: Largest offset of the look-at point from the focus, along each axis.
        roll_deg: Rotation about the viewing direction.
        clearance_m: Smallest distance to any body.
    """

    type: Literal["camera_pose"] = "camera_pose"
    stage: Literal["scene", "view"] = "view"
    camera: str = ""
    distance_m: dist.Positive = dist.Uniform(0.8, 1.3)
    azimuth_deg: dist.Scalar = dist.Uniform(0.0, 360.0)
    elevation_deg: Annotated[dist.Scalar, dist.Bounds(-90, 90)] = dist.Uniform(25.0, 65.0)
    jitter_m: dist.NonNegative = dist.Uniform(0.0, 0.1)
    roll_deg: dist.Scalar = dist.Normal(0.0, 3.0, clip=(-10.0, 10.0))
    clearance_m: float = Field(0.1, ge=0)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with its cameras moved, all outside of bodies and inside the room."""
        known = [camera.name for camera in scene.cameras if not camera.rig]
        if self.camera and self.camera not in known:
            raise ConfigError(
                f"randomizers.{self.name}.camera: no camera '{self.camera}' without a rig; "
                f"expected one of {', '.join(known) or 'none'}{did_you_mean(self.camera, known)}"
            )
        cameras = tuple(
            self._move_camera(camera, scene, assets, rng)
            if camera.name in known and self.camera in ("", camera.name)
            else camera
            for camera in scene.cameras
        )
        return replace(scene, cameras=cameras)

    def _move_camera(self, camera: Camera, scene: Scene, assets: AssetIndex, rng: Rng) -> Camera:
        x, y, z = scene.focus.center_m
        for _ in range(TRIES):
            distance_m = self.distance_m.draw(rng)
            azimuth = math.radians(self.azimuth_deg.draw(rng))
            elevation = math.radians(self.elevation_deg.draw(rng))
            jitter_m = self.jitter_m.draw(rng)
            jx, jy, jz = (jitter_m * float(rng.uniform(-1.0, 1.0)) for _ in range(3))
            roll = math.radians(self.roll_deg.draw(rng))
            target = (x + jx, y + jy, z + jz)
            level_m = distance_m * math.cos(elevation)
            eye = (
                target[0] + level_m * math.cos(azimuth),
                target[1] + level_m * math.sin(azimuth),
                target[2] + distance_m * math.sin(elevation),
            )
            if is_in_the_open(eye, scene, assets, self.clearance_m):
                return replace(camera, T_world_camera=look_at(eye, target, roll).rounded())
        remedy = "other distance_m, azimuth_deg or elevation_deg"
        raise self.reject("no free place for a camera", remedy)
