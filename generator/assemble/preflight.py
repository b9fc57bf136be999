"""Checks of nominal scenes before a run, for faults that would stop it later or give no labels."""

import math
from collections.abc import Iterable, Iterator

import numpy as np

from gen_data.annotations.text import can_write
from gen_data.assemble.config import SceneConfig
from gen_data.assets.families import known_families
from gen_data.assets.family import Family
from gen_data.assets.library import Library
from gen_data.core import errors, interfaces, scene_time, stereo, streams
from gen_data.core.scene import Camera, Region, Scene
from gen_data.randomizers.camera_pose import LENS_CHANGE, CameraPose
from gen_data.randomizers.rig_calibration import RigCalibration
from gen_data.randomizers.room_path import RoomPath
from gen_data.scene_templates.carrier import Carrier

FIDUCIAL = "fiducial"
"""Tag of markers and calibration boards."""
PAIR_REMEDY = (
    "mount them on one rig with the same size, field of view, lens and angles, the second one "
    "straight to the right of the first, and vary neither alone by a randomizer"
)


def unrectified_pairs(
    config: SceneConfig, scene: Scene, assets: interfaces.AssetIndex
) -> Iterable[errors.ConfigError]:
    """Pairs of ``stereo_with`` that are not a rectified pair in any scene of a configuration.

    Args:
        config: Configuration of the scene.
        scene: The nominal one, with all sensors.
        assets: Assets of the scene.
    """
    # A randomizer of another package may place cameras without a rig as a pair.
    are_free_ones_known = all(
        type(randomizer).__module__.startswith("gen_data.") for randomizer in config.randomizers
    )
    for randomizer in config.randomizers:
        if isinstance(randomizer, RigCalibration) and any(camera.rig for camera in scene.cameras):
            scene = randomizer(scene, assets, streams.Streams(0, 0).rng(randomizer.name))
    cameras = {camera.name: camera for camera in scene_time.place_sensors(scene).cameras}
    for sensor in config.sensors:
        other = cameras.get(getattr(sensor, "stereo_with", ""))
        here = cameras.get(sensor.name)
        if here and other and (are_free_ones_known or (here.rig and other.rig)):
            fault = _fault_of_pair(here, other)
            if fault:
                yield errors.ConfigError(
                    f"sensors.{here.name}.stereo_with: '{here.name}' and '{other.name}' are not "
                    f"a rectified pair: {fault}; {PAIR_REMEDY}"
                )


def _fault_of_pair(left: Camera, right: Camera) -> str:
    """Why two cameras are not a rectified pair; empty if they are one."""
    if not left.rig and not right.rig:
        return "each gets a separate pose"
    try:
        stereo.baseline_m(left, right)
    except ValueError as error:
        return str(error)
    return ""


def tiny_fiducials(
    config: SceneConfig, scene: Scene, assets: interfaces.AssetIndex
) -> Iterator[errors.ConfigError]:
    """Markers and boards that are smaller than a pixel in every image, as with a wrong unit.

    Only where all cameras are placed at stated distances from the scene's focus: then no draw
    brings a marker nearer. ``LENS_CHANGE`` allows for lenses that vary.
    """
    orbits = [r for r in config.randomizers if isinstance(r, CameraPose)]
    if not orbits or any(r.fills or r.rig or r.aim.outcomes() != ("",) for r in orbits):
        return
    if any(camera.rig or not _placed_by(camera, orbits) for camera in scene.cameras):
        return
    focus = np.array(scene.focus.center_m)
    for body in scene.bodies:
        if FIDUCIAL not in assets.get(body.asset).tags:
            continue
        low, high = np.array(assets.bounds_m(body.asset)) * body.scale
        size_m, away_m = (
            np.linalg.norm(high - low),
            np.linalg.norm(high)
            + np.linalg.norm(np.array(body.T_world_body.translation_m) - focus),
        )
        widths = []
        for camera in scene.cameras:
            near_m = min(
                r.distance_m.support()[0] - math.sqrt(3) * r.jitter_m.support()[1]
                for r in _placed_by(camera, orbits)
            )
            lens = camera.intrinsics
            sharp_px = LENS_CHANGE * max(lens.fx_px, lens.fy_px)
            widths.append(sharp_px * size_m / max(near_m - away_m, 1e-3))
        if max(widths, default=math.inf) < 1.0:
            yield errors.ConfigError(
                f"elements.{body.name}.asset: '{body.asset}' is {max(widths):.2g} px long at most "
                "in all images; expected at least one pixel: a larger one, more pixels "
                "(size_px), or a camera that comes nearer (distance_m)"
            )


def _placed_by(camera: Camera, orbits: Iterable[CameraPose]) -> list[CameraPose]:
    return [orbit for orbit in orbits if orbit.camera in ("", camera.name)]


def check_text(
    configs: Iterable[SceneConfig], scenes: Iterable[Scene], assets: Library, place: str
) -> None:
    """Refuse scenes in which nothing can be written on; ``place`` begins the message.

    Raises:
        ConfigError: no body, and no asset that may be added, has a texture with text.
    """
    ids: dict[str, None] = {}
    for config, scene in zip(configs, scenes, strict=True):
        textures = (material.texture for body in scene.bodies for material in body.materials)
        if can_write(assets, (*textures, *(body.asset for body in scene.bodies))):
            return
        ids |= dict.fromkeys(body.asset for body in scene.bodies)
        ids |= dict.fromkeys(asset for group in scene.groups for asset in group.assets)
        for randomizer in config.randomizers:
            ids |= dict.fromkeys(randomizer.possible_assets(assets))
    # One variant of each family first: most families have text on all variants or on none.
    turns: dict[str, int] = {}
    order = {}
    for asset_id in ids:
        family = asset_id.partition("?")[0]
        turns[family] = order[asset_id] = turns.get(family, -1) + 1
    known = known_families()
    for asset_id in sorted(ids, key=order.__getitem__):
        # The contents of images in files are unknown.
        if isinstance(known.get(asset_id.partition("?")[0]), Family):
            own = tuple(material.texture for material in assets.materials(asset_id))
            if can_write(assets, (asset_id, *own)):
                return
    raise errors.ConfigError(
        f"{place}: nothing in the scenes is written on; add objects with print, such as "
        "assets: {tags: [printed]}, signs, vehicles or buildings, or leave it out"
    )


def far_sensors(config: SceneConfig, scene: Scene) -> Iterator[str]:
    """Sensors farther from their rig than the scene is long, as with millimetres for metres."""
    sides_m = [high - low for low, high in zip(*scene.interior_m, strict=True)]
    for sensor in config.sensors:
        offset_m = math.hypot(*getattr(sensor, "offset_m", (0.0,)))
        if offset_m > math.hypot(*sides_m):
            yield (
                f"sensors.{sensor.name}.offset_m: {offset_m:g} m from its rig, but the scene is "
                f"{_meters(sides_m)} m inside; expected metres"
            )


def single_towers(scene: Scene, assets: interfaces.AssetIndex) -> Iterator[str]:
    """Groups with the placement ``stack`` of objects that are not stackable: each stands alone."""
    for group in scene.groups:
        stacked = group.assets if group.placement == "stack" else ()
        if stacked and not any(assets.get(asset).stackable for asset in stacked):
            yield (
                f"elements.{group.name}.placement: stack: none of its assets is stackable, and "
                "they stand apart as with scatter; expected assets that are flat above and below "
                "(yours with stackable: true in assets.yaml), or another placement"
            )


def cameras_that_look_away(config: SceneConfig, scene: Scene) -> Iterator[str]:
    """Cameras on carriers that stand still, whose image shows nothing of the scene's focus."""
    moves = any(isinstance(randomizer, RoomPath) for randomizer in config.randomizers)
    if moves or scene.focus == Region():
        return
    carriers = {element.name for element in config.elements if isinstance(element, Carrier)}
    rigs = {rig.name for rig in scene.rigs if rig.body in carriers}
    center, size = np.array(scene.focus.center_m), np.array(scene.focus.size_m)
    steps = np.linspace(-0.5, 0.5, 5)
    points_m = center + size * np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    for camera in scene_time.place_sensors(scene).cameras:
        if camera.rig not in rigs:
            continue
        T_world_camera = camera.T_world_camera
        rotation = np.array(T_world_camera.rotation())
        eye_m = np.array(T_world_camera.translation_m)
        lens = camera.intrinsics
        u, v = lens.project((points_m - eye_m) @ rotation).T
        with np.errstate(invalid="ignore"):
            is_seen = (u >= 0) & (u < lens.width_px) & (v >= 0) & (v < lens.height_px)
        if not is_seen.any():
            yield (
                f"sensors.{camera.name}: its image shows nothing of the scene's focus, "
                f"{_meters(size)} around ({_meters(center, ', ')}): it is at "
                f"({_meters(eye_m, ', ')}) and looks along ({_meters(rotation[:, 2], ', ')}). The "
                f"origin of the rig '{camera.rig}' is on the floor below the carrier, X forward, Z "
                "up; expected another offset_m, yaw_deg or pitch_deg"
            )


def _meters(values: Iterable[float], separator: str = " x ") -> str:
    return separator.join(f"{value:.3g}" for value in values)
