"""Camera poses on an orbit around the scene's focus or around an object in it."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from gen_data.config import distributions as dist
from gen_data.core import scene_time, se3
from gen_data.core.errors import ConfigError, did_you_mean
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Camera, Scene
from gen_data.core.streams import Rng
from gen_data.randomizers.base import RandomizerBase, check_known
from gen_data.randomizers.framing import (
    Framing,
    Thing,
    candidates,
    frame,
    measure,
    names_to_aim_at,
    smallest_and_largest_share,
)
from gen_data.randomizers.free_space import is_in_the_open

TRIES = 48
_MEASURED_MAX = 160
"""Largest number of a group's meshes that are measured before a run."""
LENS_CHANGE = 2.0
"""Largest factor by which other randomizers are assumed to change a camera's focal length."""


class CameraPose(RandomizerBase):
    """Places cameras on an orbit around the scene's focus or an object in it, aimed at it.

    The distance is given by ``distance_m``, or follows from the share of the image that the object
    fills, for the lens that the camera has then: list ``camera_intrinsics`` before it.

    Attributes:
        camera: Name of a sensor; empty = every camera that is not on a rig, drawn independently;
            with ``rig``, its first camera.
        rig: Name of a ``stand``: it is moved with all its sensors, whose places on it remain, so
            that ``camera`` is where this randomizer places it.
        aim: Target of the view: a group, of which an object is drawn, a surface, or an element by
            name; empty = the scene's focus.
        fills: Share of the image's longer side that the longer side of the projected box of the
            aimed object spans, hidden parts and parts outside the image included; above 1 it is
            truncated. Takes the place of ``distance_m`` and ``jitter_m``.
        nearest_m: With ``fills``: shortest distance from the object's centre, for lenses that focus
            on nothing nearer; smaller objects fill less of the image then.
        off_center: With ``fills``: displacement of the object's centre from the middle of the
            image, along both axes, drawn for each; 1 = a square of the object's size touches
            the border.
        distance_m: Distance to the look-at point.
        azimuth_deg: Angle around the vertical: 0 is on the +X side, 90 on the +Y side.
        elevation_deg: Angle above the horizon.
        jitter_m: Largest offset of the look-at point from the focus or the object's centre, along
            each axis.
        roll_deg: Rotation about the viewing direction.
        clearance_m: Smallest distance to any body.
    """

    type: Literal["camera_pose"] = "camera_pose"
    stage: Literal["scene", "view"] = "view"
    camera: str = ""
    rig: str = ""
    aim: dist.Name = dist.Constant("")
    fills: Annotated[dist.Scalar, dist.Bounds(0, 4, open_low=True)] | None = None
    nearest_m: float = Field(0.0, ge=0)
    off_center: Annotated[dist.Scalar, dist.Bounds(-1, 1)] = dist.Normal(0.0, 0.35, clip=(-1, 1))
    distance_m: dist.Positive = dist.Uniform(0.8, 1.3)
    azimuth_deg: dist.Scalar = dist.Uniform(0.0, 360.0)
    elevation_deg: Annotated[dist.Scalar, dist.Bounds(-90, 90)] = dist.Uniform(25.0, 65.0)
    jitter_m: dist.NonNegative = dist.Uniform(0.0, 0.1)
    roll_deg: dist.Scalar = dist.Normal(0.0, 3.0, clip=(-10.0, 10.0))
    clearance_m: float = Field(0.1, ge=0)

    @model_validator(mode="after")
    def _has_one_distance(self) -> "CameraPose":
        given = self.model_fields_set
        if self.fills is None:
            if "off_center" in given:
                raise ValueError("off_center: needs fills; displace the look-at point by jitter_m")
            if "nearest_m" in given:
                raise ValueError("nearest_m: needs fills; distance_m states the distance itself")
            return self
        for name in ("distance_m", "jitter_m"):
            if name in given:
                instead = "off_center" if name == "jitter_m" else "fills alone"
                raise ValueError(f"{name}: excludes fills; expected {instead}")
        return self

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """Check names, and whether some distance in the scene's interior gives the share.

        Raises:
            ConfigError: a name is unknown, or no camera can see an object as large or as small.
        """
        known = names_to_aim_at(scene)
        for name in self.aim.outcomes():
            if name:
                fault = f"randomizers.{self.name}.aim: nothing in the scene is named"
                check_known(name, known, fault)
        self._check_distance(scene)
        for camera in self._moved(scene):
            self._check_reach(camera, scene, assets)

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """Return the scene with its cameras moved, all outside of bodies and inside the room."""
        place = self._move_camera if self.fills is None else self._frame_thing
        moved = {camera.name: place(camera, scene, assets, rng) for camera in self._moved(scene)}
        if self.rig:
            (aimed,) = moved.values()
            return _with_rig(scene, self.rig, aimed)
        cameras = tuple(moved.get(camera.name, camera) for camera in scene.cameras)
        return replace(scene, cameras=cameras)

    def _moved(self, scene: Scene) -> tuple[Camera, ...]:
        """The cameras to place: without a rig, all that are meant; with one, one on it."""
        if self.rig:
            stands = [rig.name for rig in scene.rigs if not rig.body]
            fault = f"randomizers.{self.name}.rig: there is no stand"
            check_known(self.rig, stands, fault)
        free = tuple(camera for camera in scene.cameras if camera.rig == self.rig)
        meant = tuple(camera for camera in free if self.camera in ("", camera.name))
        if not meant and (self.camera or self.rig):
            known = [camera.name for camera in free]
            where = f"on the rig '{self.rig}'" if self.rig else "without a rig"
            raise ConfigError(
                f"randomizers.{self.name}.camera: no camera '{self.camera}' {where}; "
                f"expected one of {', '.join(known) or 'none'}{did_you_mean(self.camera, known)}"
            )
        return meant[:1] if self.rig else meant

    def _is_free(self, camera: Camera, pose: se3.SE3, scene: Scene, assets: AssetIndex) -> bool:
        """Whether a camera, and the others on its rig, are clear of bodies at a pose."""
        T_world_rig = pose @ camera.T_rig_camera.inverse()
        others = [c for c in scene.cameras if self.rig and c.rig == self.rig and c != camera]
        places = [pose, *(T_world_rig @ other.T_rig_camera for other in others)]
        return all(
            is_in_the_open(place.translation_m, scene, assets, self.clearance_m) for place in places
        )

    def _move_camera(self, camera: Camera, scene: Scene, assets: AssetIndex, rng: Rng) -> Camera:
        x, y, z = self._draw_thing(scene, assets, rng).center_m
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
            pose = se3.look_at(eye, target, roll)
            if self._is_free(camera, pose, scene, assets):
                return replace(camera, T_world_camera=pose.rounded())
        remedy = "other distance_m, azimuth_deg or elevation_deg"
        raise self.reject(f"no free place for camera '{camera.name}'", remedy)

    def _frame_thing(self, camera: Camera, scene: Scene, assets: AssetIndex, rng: Rng) -> Camera:
        """Draw the share once: places that are taken change object and direction, not the share.

        Otherwise large shares of small objects, near others, would be rarer than declared. Only
        where all places are taken, as in a compartment, the mean of the share and the smallest
        declared one is tried, and then the smallest, as at the bottom of a bag.
        """
        assert self.fills is not None, "only framed cameras come here"
        seen = False
        drawn, smallest = self.fills.draw(rng), self.fills.support()[0]
        for share in dict.fromkeys((drawn, 0.5 * (drawn + smallest), smallest)):
            for _ in range(TRIES):
                thing = self._draw_thing(scene, assets, rng)
                framing = self._draw_framing(share, camera, rng)
                pose = frame(thing, framing, camera.intrinsics, self.nearest_m)
                seen = seen or pose is not None
                if pose is not None and self._is_free(camera, pose, scene, assets):
                    return replace(camera, T_world_camera=pose.rounded())
        if not seen:
            remedy = "a smaller range of fills or off_center, or another lens"
            reason = f"the lens of camera '{camera.name}' cannot show an object at the drawn share"
            raise self.reject(reason, remedy)
        remedy = "another range of fills, azimuth_deg or elevation_deg, or a smaller clearance_m"
        reason = f"no free place from which camera '{camera.name}' frames an object"
        raise self.reject(reason, remedy)

    def _draw_thing(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Thing:
        name = self.aim.draw(rng)
        found = candidates(scene, name)
        if not found:
            if name not in names_to_aim_at(scene):
                self.check(scene, assets)
            raise self.reject(f"no object of the group '{name}' to aim at", "another count or aim")
        return measure(found[int(rng.integers(len(found))) if len(found) > 1 else 0], assets)

    def _draw_framing(self, share: float, camera: Camera, rng: Rng) -> Framing:
        azimuth = math.radians(self.azimuth_deg.draw(rng))
        elevation = math.radians(self.elevation_deg.draw(rng))
        level = math.cos(elevation)
        toward = (level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation))
        sides_px = camera.intrinsics.width_px, camera.intrinsics.height_px
        u, v = (
            0.5 * side + 0.5 * max(0.0, side - share * max(sides_px)) * self.off_center.draw(rng)
            for side in sides_px
        )
        return Framing(share, toward, (u, v), math.radians(self.roll_deg.draw(rng)))

    def _check_distance(self, scene: Scene) -> None:
        """Raise ConfigError if no distance to draw leaves a camera in the scene's interior."""
        least_m = self.distance_m.support()[0] - self.jitter_m.support()[1] * math.sqrt(3.0)
        across_m = math.dist(*scene.interior_m)
        if self.fills is None and least_m > across_m:
            sides_m = (b - a for a, b in zip(*scene.interior_m, strict=True))
            raise ConfigError(
                f"randomizers.{self.name}.distance_m: at least {self.distance_m.support()[0]:g} m, "
                f"but the scene is {' x '.join(f'{side:.3g}' for side in sides_m)} m inside, "
                f"{across_m:.3g} m from corner to corner; expected metres within it"
            )

    def _check_reach(self, camera: Camera, scene: Scene, assets: AssetIndex) -> None:
        """Raise ConfigError if every share to draw is out of reach, for anything to aim at."""
        if self.fills is None:
            return
        low, high = self.fills.support()
        image_px = max(camera.intrinsics.width_px, camera.intrinsics.height_px)
        farthest_m = math.dist(*scene.interior_m)
        smallest, largest = smallest_and_largest_share(
            self._sizes_m(scene, assets), camera.intrinsics.fx_px, image_px, self.clearance_m,
            farthest_m,
        )  # fmt: skip
        fault = f"randomizers.{self.name}.fills: "
        if high * LENS_CHANGE < smallest:
            raise ConfigError(
                f"{fault}at most {high:g} of the image of camera '{camera.name}', but the smallest "
                f"object fills about {smallest:.2g} from the farthest place, {farthest_m:.3g} m "
                "away; expected a larger share, a wider lens or a larger room"
            )
        if low > LENS_CHANGE * largest:
            raise ConfigError(
                f"{fault}at least {low:g} of the image of camera '{camera.name}', but the largest "
                f"object fills about {largest:.2g} at the clearance_m of {self.clearance_m:g}; "
                "expected a smaller share, a smaller clearance_m or a longer lens"
            )

    def _sizes_m(self, scene: Scene, assets: AssetIndex) -> Iterator[se3.Vec3]:
        """Sizes of objects that may be aimed at, along their axes [m]."""
        groups = {group.name: group.assets for group in scene.groups}
        for name in self.aim.outcomes():
            listed = groups.get(name, ())
            # Any of hundreds of meshes may have to be made: an even selection has every family.
            step = max(1.0, len(listed) / _MEASURED_MAX)
            for asset in (listed[int(i * step)] for i in range(min(len(listed), _MEASURED_MAX))):
                yield _extent_m(np.array(assets.bounds_m(asset)))
            for found in () if name in groups else candidates(scene, name):
                yield _extent_m(measure(found, assets).points_m)


def _with_rig(scene: Scene, name: str, aimed: Camera) -> Scene:
    """The scene with a rig, and all its sensors, where one of its cameras has its new pose."""
    pose = (aimed.T_world_camera @ aimed.T_rig_camera.inverse()).rounded(9)
    rigs = tuple(replace(r, T_body_rig=pose) if r.name == name else r for r in scene.rigs)
    return scene_time.place_sensors(replace(scene, rigs=rigs))


def _extent_m(points_m: se3.Array) -> se3.Vec3:
    """Extents of points along the axes [m]."""
    x, y, z = (float(side) for side in np.ptp(points_m, axis=0))
    return (x, y, z)
