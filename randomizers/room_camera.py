"""Cameras in rooms: where a person or a robot can stand, looking at furniture."""

import math
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Body, Camera, Scene
from gen_data.core.se3 import Array, Vec3, look_at
from gen_data.core.streams import Rng
from gen_data.randomizers import base, free_space

TRIES = 96
_WALL_M = 0.4
"""Smallest distance of a camera from walls."""
_HIDDEN_MAX, _HIDDEN_MIDDLE_MAX = 0.15, 0.02
"""Largest shares of the image, and of its middle, that near bodies may hide."""
_MIDDLE = 0.55
"""Half of the middle's width and height, as shares of the image's."""
_FAR_M = 12.0
_LARGE_M, _RAYS_EACH = 0.45, 8


class RoomCamera(base.RandomizerBase):
    """Places every camera without a rig on free floor of a room, looking at a piece in it.

    Attributes:
        room: Name of the template's ``room_layout`` element.
        height_m: Height of the camera: 1.2 to 1.7 by hand, 0.2 to 1.2 on a robot.
        pitch_deg: Upward tilt.
        yaw_deg: Rotation away from the piece that it looks at.
        roll_deg: Clockwise rotation about the viewing direction.
        away_m: Smallest distance from that piece.
        clearance_m: Smallest distance to any body.
        near_m: Distance within which bodies, but floors and ceilings, may hide no more than a
            seventh of the image, and nothing in its middle.
        min_pieces: Smallest number of pieces whose origins are in the image; half of
            all pieces if that is fewer.
        choices: Number of places to choose from: the one from which most furniture is seen well.
    """

    type: Literal["room_camera"] = "room_camera"
    stage: Literal["scene", "view"] = "view"
    room: str = "room"
    height_m: dist.Positive = dist.Uniform(1.0, 1.75)
    pitch_deg: Annotated[dist.Scalar, dist.Bounds(-89, 89)] = dist.Normal(
        -9.0, 4.5, clip=(-20.0, 4.0)
    )
    yaw_deg: dist.Scalar = dist.Normal(0.0, 12.0, clip=(-30.0, 30.0))
    roll_deg: dist.Scalar = dist.Normal(0.0, 0.8, clip=(-3.0, 3.0))
    away_m: float = Field(1.3, ge=0)
    clearance_m: float = Field(0.25, ge=0)
    near_m: float = Field(0.9, ge=0)
    min_pieces: int = Field(7, ge=0, le=100)
    choices: int = Field(5, ge=1, le=32)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with its cameras moved. Raises LayoutRejected if no place is free."""
        floors, pieces = self._find(scene)
        cameras = list(scene.cameras)
        for k, camera in enumerate(cameras):
            if camera.rig:
                continue
            cameras[k] = self._place(camera, scene, floors, pieces, assets, rng)
        return replace(scene, cameras=tuple(cameras))

    def _place(
        self,
        camera: Camera,
        scene: Scene,
        floors: list[Body],
        pieces: list[Body],
        assets: AssetIndex,
        rng: Rng,
    ) -> Camera:
        """The camera at the best of several places. Raises LayoutRejected if there is none."""
        origins_m = np.array([body.T_world_body.translation_m for body in pieces])
        least = min(self.min_pieces, len(pieces) // 2)
        large = {body.name for body in pieces if _is_large(body, assets)}
        found: list[tuple[int, Camera]] = []
        for _ in range(TRIES):
            drawn = self._draw_pose(scene, floors, pieces, assets, rng)
            if drawn is None:
                continue
            eye, target, roll = drawn
            moved = replace(camera, T_world_camera=look_at(eye, target, roll).rounded())
            if _count_in_view(moved, origins_m) < least:
                continue
            sight = free_space.look_around(moved, scene, assets, _FAR_M)
            if _is_hidden(sight, self.near_m):
                continue
            found.append((_count_furniture(sight, large), moved))
            if len(found) == self.choices:
                break
        if not found:
            remedy = "a smaller away_m, clearance_m or near_m, or another height_m"
            raise self.reject(f"no free place for camera '{camera.name}' in the room", remedy)
        return max(found, key=lambda one: one[0])[1]

    def _find(self, scene: Scene) -> tuple[list[Body], list[Body]]:
        own = [b for b in scene.bodies if b.name.partition("/")[0] == self.room]
        floors = [b for b in own if b.name.endswith("/floor")]
        return floors, [b for b in own if b.group == self.room and b.part_id < 2]

    def _draw_pose(
        self, scene: Scene, floors: list[Body], pieces: list[Body], assets: AssetIndex, rng: Rng
    ) -> tuple[Vec3, Vec3, float] | None:
        """Draw eye, target and roll; None if the place is taken or too near."""
        floor = floors[min(int(rng.random() * len(floors)), len(floors) - 1)]
        (x0, y0, _), (x1, y1, _) = assets.bounds_m(floor.asset)
        mx, my, _ = floor.T_world_body.translation_m
        x = mx + (2.0 * float(rng.random()) - 1.0) * max(0.5 * (x1 - x0) - _WALL_M, 0.0)
        y = my + (2.0 * float(rng.random()) - 1.0) * max(0.5 * (y1 - y0) - _WALL_M, 0.0)
        eye = (x, y, min(self.height_m.draw(rng), scene.interior_m[1][2] - _WALL_M))
        here = [
            b
            for b in pieces
            if abs(b.T_world_body.translation_m[0] - mx) < 0.5 * (x1 - x0)
            and abs(b.T_world_body.translation_m[1] - my) < 0.5 * (y1 - y0)
        ]
        if not here:
            return None
        tx, ty, _ = here[
            min(int(rng.random() * len(here)), len(here) - 1)
        ].T_world_body.translation_m
        yaw = math.atan2(ty - y, tx - x) + math.radians(self.yaw_deg.draw(rng))
        pitch, roll = math.radians(self.pitch_deg.draw(rng)), math.radians(self.roll_deg.draw(rng))
        # The room's middle lies ahead, not behind the camera: views into corners show little.
        ahead = (mx - x) * math.cos(yaw) + (my - y) * math.sin(yaw)
        if math.hypot(tx - x, ty - y) < self.away_m or ahead < 0.0:
            return None
        if not free_space.is_clear(eye, scene, assets, self.clearance_m):
            return None
        target = (
            x + math.cos(pitch) * math.cos(yaw),
            y + math.cos(pitch) * math.sin(yaw),
            eye[2] + math.sin(pitch),
        )
        return eye, target, roll


def _is_hidden(sight: free_space.Sight, near_m: float) -> bool:
    """Whether near surfaces, but floors and ceilings, hide too much of an image."""
    flat = [body.name.endswith(("/floor", "/ceiling")) for body in sight.bodies]
    near = (sight.distances_m <= near_m) & ~np.array([*flat, True])[sight.hits]
    middle = (np.abs(sight.places) < _MIDDLE).all(axis=1)
    return bool(near.mean() > _HIDDEN_MAX or near[middle].mean() > _HIDDEN_MIDDLE_MAX)


def _is_large(body: Body, assets: AssetIndex) -> bool:
    low, high = assets.bounds_m(body.asset)
    return max(b - a for a, b in zip(low, high, strict=True)) > _LARGE_M


def _count_furniture(sight: free_space.Sight, names: set[str]) -> int:
    """Rays that meet pieces of these names; no more than a few count for each of them."""
    each = np.bincount(sight.hits[sight.hits >= 0], minlength=len(sight.bodies))
    return sum(
        min(int(rays), _RAYS_EACH)
        for body, rays in zip(sight.bodies, each, strict=True)
        if body.name in names
    )


def _count_in_view(camera: Camera, points_m: Array) -> int:
    """Number of points [n, 3] that are within the image."""
    if not len(points_m):
        return 0
    x, y, z = camera.T_world_camera.inverse().apply(points_m).T
    k = camera.intrinsics
    ahead = z > 0.3
    deep = np.where(ahead, z, 1.0)
    u, v = k.fx_px * x / deep + k.cx_px, k.fy_px * y / deep + k.cy_px
    seen = ahead & (u > 0) & (u < k.width_px) & (v > 0) & (v < k.height_px)
    return int(seen.sum())
