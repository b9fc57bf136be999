"""Occupancy: states of the voxels of a box around the ego, and their observation by its sensors.

Voxels come from the geometry, not from points of a scanner: hidden ones are known, and moving
objects leave no trails. Readings tell only which voxels a sensor has observed.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from gen_data.annotations.voxel_bodies import bodies_near, sample_body
from gen_data.annotations.voxel_box import VoxelBox
from gen_data.annotations.voxel_painter import VoxelPainter
from gen_data.annotations.voxel_views import seen_by_camera, seen_by_scanner
from gen_data.config.base_model import Strict
from gen_data.core import capture, errors, interfaces
from gen_data.core.sample import VOXEL_STATES, EgoTruth, Occupancy
from gen_data.core.scene import Body, Scene
from gen_data.core.scene_time import ego_rig
from gen_data.core.se3 import IDENTITY, SE3, Vec3

VOXELS_MAX = 1 << 26
"""2^26 voxels take 0.8 GB in a worker, with the masks of three sensors."""
BYTES_PER_VOXEL = 12
WORLD = "world"
SURFACE, INTERIOR = VOXEL_STATES.index("surface"), VOXEL_STATES.index("interior")


class VoxelOccupancy(Strict):
    """Voxels of a box around the ego: state, instance, surface, and which sensors observe them.

    A voxel is ``surface`` if it contains a sample of an object's surface, else ``interior`` if it
    is within an object, as in a wall or in a closed car, or below the ground, else ``free``.
    Where several objects share a voxel, instances win over the unlabelled background, and smaller
    ones over larger ones. The object that carries the ego's rig is left out, unless the frame is
    the world. Cut-outs of textures count as surface.

    A camera observes a voxel if a pixel shows a surface in it, or if the pixel at its centre shows
    something behind it. A scanner observes the voxels that the lines to its returns pass and end
    in. Air that no return came from is not observed.

    Attributes:
        size_m: Size of the box, along the axes of the frame.
        voxel_m: Side of a voxel.
        from_m: Lowest corner of the box in its frame; null = the box is centred on the frame's
            origin along X and Y, and begins 1 m below it.
        frame: Name of the scanner whose frame it is, or ``world``; empty = the ego's rig, or the
            world in scenes without one.
    """

    channels: ClassVar[frozenset[capture.Channel]] = frozenset({capture.Channel.RANGE})
    type: Literal["occupancy"] = "occupancy"
    size_m: Vec3 = (80.0, 80.0, 6.4)
    voxel_m: float = Field(0.4, ge=0.001, le=10)
    from_m: Vec3 | None = None
    frame: str = ""

    @model_validator(mode="after")
    def _check(self) -> "VoxelOccupancy":
        if min(self.size_m) < self.voxel_m:
            raise ValueError(f"size_m: {list(self.size_m)} m is less than a voxel along an axis")
        for side_m in self.size_m:
            count = side_m / self.voxel_m
            if abs(count - round(count)) > 1e-6 * count:
                raise ValueError(
                    f"size_m: {side_m:g} m is not a multiple of voxel_m, {self.voxel_m:g} m"
                )
        total = math.prod(self.shape)
        if total > VOXELS_MAX:
            raise ValueError(
                f"size_m: {total:,} voxels need {total * BYTES_PER_VOXEL / 1e9:.1f} GB in every"
                f" worker; at most {VOXELS_MAX:,} are possible: raise voxel_m or lower size_m"
            )
        return self

    @property
    def shape(self) -> tuple[int, int, int]:
        """Voxels along X, Y and Z."""
        nx, ny, nz = (round(side_m / self.voxel_m) for side_m in self.size_m)
        return nx, ny, nz

    def annotate_capture(
        self,
        scenes: Mapping[str, Scene],
        assets: interfaces.AssetLibrary,
        capture: capture.Capture,
        truth: EgoTruth,
    ) -> EgoTruth:
        """Fill in ``occupancy``.

        Raises:
            ConfigError: the scene has no scanner of the name ``frame``.
        """
        scene = scenes[""]
        box = VoxelBox(self._pose(scene), self._low_m(), self.voxel_m, self.shape)
        rig = ego_rig(scene)
        carried = rig is not None and rig.body and self.frame != WORLD
        own = scene.body(rig.body).instance_id if rig is not None and carried else 0
        state, owner, surface = _fill(box, scene, assets, own)
        readings, clouds = capture.readings, capture.clouds
        observed = {name: seen_by_camera(box, scene, readings[name]) for name in sorted(readings)}
        for name in sorted(clouds):
            observed[name] = seen_by_scanner(box, scenes.get(name, scene), clouds[name])
        return replace(
            truth,
            occupancy=Occupancy(
                box.T_world_frame, box.low_m, self.voxel_m, state, owner, surface, observed
            ),
        )

    def check(self, scene: Scene) -> None:
        """Reject a frame that a scene lacks.

        Raises:
            ConfigError: the scene has no scanner of the name ``frame``.
        """
        self._pose(scene)

    def _low_m(self) -> Vec3:
        x, y, _ = self.size_m
        return self.from_m or (-0.5 * x, -0.5 * y, -1.0)

    def _pose(self, scene: Scene) -> SE3:
        if self.frame == WORLD:
            return IDENTITY
        if self.frame:
            for lidar in scene.lidars:
                if lidar.name == self.frame:
                    return lidar.T_world_lidar
            known = ", ".join([WORLD, *sorted(lidar.name for lidar in scene.lidars)])
            raise errors.ConfigError(
                f"annotations.occupancy.frame: there is no scanner '{self.frame}'; expected one of:"
                f" {known}{errors.did_you_mean(self.frame, known.split(', '))}"
            )
        rig = ego_rig(scene)
        return scene.rig_pose(rig.name).rounded() if rig is not None else IDENTITY


def _fill(
    box: VoxelBox, scene: Scene, assets: interfaces.AssetLibrary, own: int
) -> tuple[NDArray[np.uint8], NDArray[np.uint16], NDArray[np.uint8]]:
    """State, instance and surface of all voxels."""
    T_frame_world = box.T_world_frame.inverse()
    kept = [body for body in scene.bodies if not own or body.instance_id != own]
    found = [
        (body.instance_id, samples)
        for body in _by_rank(bodies_near(kept, T_frame_world, box, assets), scene)
        if (samples := sample_body(body, T_frame_world @ body.T_world_body, box, assets))
    ]
    # Later ones overwrite earlier ones: interiors first, the most important ones last.
    painter = VoxelPainter(box)
    for number, samples in found:
        ink = _inks(INTERIOR, number, np.zeros(1, np.uint8))
        painter.paint(samples.inside, samples.onto, ink)
        if samples.solid is not None:
            painter.flush()
            painter.values[samples.solid] = ink[0]
    for number, samples in found:
        inks = _inks(SURFACE, number, samples.kinds)
        is_ground = samples.is_sheet and number == 0
        if painter.marking != is_ground:
            painter.flush()
            painter.marking = is_ground
        for part in samples.surface:
            painter.paint(part, samples.onto, inks)
    painter.flush()
    values = painter.values
    state = values.astype(np.uint8)
    state[(state == 0) & _below(painter.marks)] = INTERIOR
    values >>= 8
    surface = values.astype(np.uint8)
    values >>= 8
    return state, values.astype(np.uint16), surface


def _inks(state: int, instance_id: int, kinds: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Instance (16 bits), kind of surface (8) and state (8) in one number."""
    return np.asarray((instance_id << 16 | state) + (kinds.astype(np.uint32) << 8), np.uint32)


def _by_rank(bodies: Sequence[Body], scene: Scene) -> list[Body]:
    """Background first, then instances by falling volume."""
    present = {body.instance_id for body in bodies}
    volumes = {
        i.instance_id: math.prod(i.box3d.size_m)
        for i in scene.instances
        if i.instance_id in present
    }
    numbers = sorted(volumes, key=lambda k: (-volumes[k], k))
    ranks = {number: rank for rank, number in enumerate(numbers)}
    return sorted(bodies, key=lambda body: ranks.get(body.instance_id, -1))


def _below(ground: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Voxels below the lowest ground of their column, bool [x, y, z]; none without ground."""
    lowest = ground.argmax(axis=2)
    return np.asarray(np.arange(ground.shape[2]) < lowest[..., None])
