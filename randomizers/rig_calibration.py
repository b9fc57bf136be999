"""Mounting errors of the sensors on a rig."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Literal, TypeVar

from gen_data.config import distributions as dist
from gen_data.core import errors, interfaces, scene_time, se3, streams
from gen_data.core.scene import Camera, Device, Lidar, Scene
from gen_data.randomizers.base import RandomizerBase

Sensor = TypeVar("Sensor", Camera, Lidar, Device)


class RigCalibration(RandomizerBase):
    """Perturbs the pose of sensors on their rigs, as no two vehicles are built alike.

    Labels and calibration files contain the perturbed poses. A calibration that states another pose
    than the true one is the fault ``extrinsics`` of a sensor.

    Attributes:
        rig: Name of a rig; empty = every rig.
        whole: Whether a rig moves as one on its carrier: its sensors keep their places on it.
        offset_m: Offset along each axis of the sensor, or of the whole rig.
        turn_deg: Rotation about each axis of the sensor, or of the whole rig.
    """

    type: Literal["rig_calibration"] = "rig_calibration"
    rig: str = ""
    whole: bool = False
    offset_m: dist.Scalar = dist.Normal(0.0, 0.005, clip=(-0.02, 0.02))
    turn_deg: dist.Scalar = dist.Normal(0.0, 0.2, clip=(-1.0, 1.0))

    def check(self, scene: Scene, assets: interfaces.AssetIndex) -> None:
        """Raise ConfigError if no sensor is on such a rig."""
        del assets
        self._find_rigs(scene)

    def _find_rigs(self, scene: Scene) -> set[str]:
        """Names of the rigs to perturb."""
        sensors: tuple[Camera | Lidar | Device, ...]
        sensors = (*scene.cameras, *scene.lidars, *scene.devices)
        known = sorted({sensor.rig for sensor in sensors if sensor.rig})
        if not known or (self.rig and self.rig not in known):
            raise errors.ConfigError(
                f"randomizers.{self.name}.rig: no sensor is on a rig '{self.rig}'; rigs with "
                f"sensors: {', '.join(known) or 'none'}{errors.did_you_mean(self.rig, known)}"
            )
        return {self.rig} if self.rig else set(known)

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with perturbed sensor poses."""
        del assets
        rigs = self._find_rigs(scene)
        if self.whole:
            moved = (
                replace(r, T_body_rig=self._perturb(r.T_body_rig, rng)) if r.name in rigs else r
                for r in scene.rigs
            )
            return scene_time.place_sensors(replace(scene, rigs=tuple(moved)))

        def perturb_all(sensors: tuple[Sensor, ...], pose: str) -> tuple[Sensor, ...]:
            changes: Iterator[dict[str, Any]] = (
                {pose: self._perturb(getattr(s, pose), rng)} if s.rig in rigs else {}
                for s in sensors
            )
            return tuple(replace(s, **c) for s, c in zip(sensors, changes, strict=True))

        return scene_time.place_sensors(
            replace(
                scene,
                cameras=perturb_all(scene.cameras, "T_rig_camera"),
                lidars=perturb_all(scene.lidars, "T_rig_lidar"),
                devices=perturb_all(scene.devices, "T_rig_device"),
            )
        )

    def _perturb(self, T_rig_sensor: se3.SE3, rng: streams.Rng) -> se3.SE3:
        """Apply an offset, then a rotation about each axis of the sensor."""
        x, y, z = (self.offset_m.draw(rng) for _ in range(3))
        half = [0.5 * math.radians(self.turn_deg.draw(rng)) for _ in range(3)]
        turn = (1.0, 0.0, 0.0, 0.0)
        for axis, angle in enumerate(half):
            about = [math.cos(angle), 0.0, 0.0, 0.0]
            about[axis + 1] = math.sin(angle)
            turn = se3.multiply_quaternions(turn, (about[0], about[1], about[2], about[3]))
        return (T_rig_sensor @ se3.SE3((x, y, z), turn)).rounded()
