"""Cameras below the ceilings of rooms, looking down."""

import math
from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core import errors, interfaces, se3, streams
from gen_data.core.scene import Scene
from gen_data.randomizers import base, free_space

TRIES = 48


class CeilingCamera(base.RandomizerBase):
    """Places every camera without a rig below the ceiling of a room, looking down.

    Attributes:
        room: Name of the template's ``room_layout`` element.
        below_m: Distance of the camera's centre from the ceiling.
        off_center: Position along both axes of a room, drawn for each: 0 = its middle, 1 and -1 =
            its walls.
        tilt_deg: Angle of the optical axis from the vertical, towards a drawn side.
        clearance_m: Smallest distance to any body, also to lamps and the ceiling.
    """

    type: Literal["ceiling_camera"] = "ceiling_camera"
    stage: Literal["scene", "view"] = "view"
    room: str = "room"
    below_m: Annotated[dist.Positive, dist.Bounds(0.01, 1.0)] = dist.Uniform(0.06, 0.14)
    off_center: Annotated[dist.Scalar, dist.Bounds(-0.95, 0.95)] = dist.Uniform(-0.5, 0.5)
    tilt_deg: Annotated[dist.NonNegative, dist.Bounds(0.0, 60.0)] = dist.Uniform(0.0, 4.0)
    clearance_m: float = Field(0.05, ge=0)

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with its cameras moved.

        Raises:
            ConfigError: there is no such room.
            LayoutRejected: no place is free.
        """
        cameras = tuple(
            camera
            if camera.rig
            else replace(camera, T_world_camera=self._draw_pose(scene, assets, rng))
            for camera in scene.cameras
        )
        return replace(scene, cameras=cameras)

    def _draw_pose(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> se3.SE3:
        ceilings = [
            body
            for body in scene.bodies
            if body.name.startswith(f"{self.room}/") and body.name.endswith("/ceiling")
        ]
        if not ceilings:
            raise errors.ConfigError(
                f"randomizers.{self.name}.room: the template has no element '{self.room}' of type "
                "room_layout"
            )
        for _ in range(TRIES):
            ceiling = ceilings[min(int(rng.random() * len(ceilings)), len(ceilings) - 1)]
            (x0, y0, _), (x1, y1, _) = assets.bounds_m(ceiling.asset)
            x, y, z = ceiling.T_world_body.translation_m
            x += 0.5 * (x0 + x1 + self.off_center.draw(rng) * (x1 - x0))
            y += 0.5 * (y0 + y1 + self.off_center.draw(rng) * (y1 - y0))
            z -= self.below_m.draw(rng)
            tilt = math.radians(self.tilt_deg.draw(rng))
            side, roll = (2.0 * math.pi * float(rng.random()) for _ in range(2))
            if free_space.is_clear((x, y, z), scene, assets, self.clearance_m):
                across, down = math.sin(tilt), math.cos(tilt)
                target = (x + across * math.cos(side), y + across * math.sin(side), z - down)
                return se3.look_at((x, y, z), target, roll).rounded()
        raise self.reject(
            "no free place for a camera below the ceiling",
            "a smaller clearance_m, or a larger below_m",
        )
