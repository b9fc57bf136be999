"""Checks of nominal scenes before a run: what would stop it later, or give no labels."""

from __future__ import annotations

from collections.abc import Iterable

from gen_data.generator.assemble.config import SceneConfig
from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Camera, Scene
from gen_data.generator.core.scene_time import place_sensors
from gen_data.generator.core.stereo import baseline_m
from gen_data.generator.core.streams import Streams
from gen_data.randomizers.rig_calibration import RigCalibration

PAIR_REMEDY = (
    "mount them on one rig with the same size, field of view, lens and angles, the right one "
    "beside the left, and vary neither alone by a randomizer"
)


def unrectified_pairs(
    config: SceneConfig, scene: Scene, assets: AssetIndex
) -> Iterable[ConfigError]:
    """Pairs of ``stereo_with`` that are no rectified pair in any scene of a configuration.

    Args:
        config: Of the scene.
        scene: The nominal one, with all sensors.
        assets: Of the scene.
    """
    # A randomizer of another package may place cameras without a rig as a pair.
    are_free_ones_known = all(
        type(randomizer).__module__.startswith("gen_data.") for randomizer in config.randomizers
    )
    for randomizer in config.randomizers:
        if isinstance(randomizer, RigCalibration) and any(camera.rig for camera in scene.cameras):
            scene = randomizer(scene, assets, Streams(0, 0).rng(randomizer.name))
    cameras = {camera.name: camera for camera in place_sensors(scene).cameras}
    for sensor in config.sensors:
        other = cameras.get(getattr(sensor, "stereo_with", ""))
        here = cameras.get(sensor.name)
        if here and other and (are_free_ones_known or (here.rig and other.rig)):
            fault = _fault_of_pair(here, other)
            if fault:
                yield ConfigError(
                    f"sensors.{here.name}.stereo_with: '{here.name}' and '{other.name}' are no "
                    f"rectified pair: {fault}; {PAIR_REMEDY}"
                )


def _fault_of_pair(left: Camera, right: Camera) -> str:
    """Why two cameras are no rectified pair; empty if they are one."""
    if not left.rig and not right.rig:
        return "each gets a pose of its own"
    try:
        baseline_m(left, right)
    except ValueError as error:
        return str(error)
    return ""
