"""Scenes at other instants."""

import math
from collections.abc import Mapping
from dataclasses import replace

from gen_data.core.motion import STILL, StateChange, Twist
from gen_data.core.scene import (
    Articulation,
    Body,
    Camera,
    Device,
    Instance,
    Lidar,
    Light,
    Rig,
    Scene,
)
from gen_data.core.se3 import SE3, rotate_by_quaternion

RIG_AXES = SE3((0.0, 0.0, 0.0), (0.5, 0.5, -0.5, 0.5))
"""``T_camera_rig``: X forward, Y left, Z up in the camera's X right, Y down, Z forward."""
HAND_RIG_AXES = SE3((0.0, 0.0, 0.0), (math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0))
"""``T_hand_rig``: X of the rig on a hand is the hand's Z, out of it; they share the Y axis."""

_DRIVEN = frozenset({"driving", "bicycle"})
_SITTING = "sitting"

EGO = "ego"
"""Name of the rig that truth about a sample as a whole refers to."""


def wrist_name(robot: str) -> str:
    """Name of the rig on the hand of a robot; its axes are ``HAND_RIG_AXES``."""
    return f"{robot}_wrist"


def scene_at(scene: Scene, time_s: float) -> Scene:
    """The scene at another instant.

    Moves bodies, joints, lights, rigs, sensors and the frames of instances along the trajectories,
    and applies the state changes up to then. Changes are accumulated from time 0; the result does
    not depend on the scene's current instant. A body keeps its state until its first change.

    Boxes of instances with several bodies (robots) are not updated, as that takes geometry: scenes
    for sensors and labels come from ``gen_data.pipeline.finalize_scene.Timeline``.
    """
    if time_s == scene.time_s:
        return scene
    if not (scene.tracks or scene.changes):
        return place_sensors(replace(scene, time_s=time_s))
    tracks = {track.body: track for track in scene.tracks}
    changes = _accumulate_changes(scene.changes, time_s)
    bodies = tuple(
        _apply_change(
            replace(body, T_world_body=tracks[body.name].pose(time_s).rounded())
            if body.name in tracks
            else body,
            changes.get(body.name),
        )
        for body in scene.bodies
    )
    moved = {
        old.name: new.T_world_body @ old.T_world_body.inverse()
        for old, new in zip(scene.bodies, bodies, strict=True)
        if old.name in tracks
    }
    articulations = tuple(_moved_joints(a, time_s) for a in scene.articulations)
    lights = tuple(
        moved_light(light, moved[light.body]) if light.body in moved else light
        for light in scene.lights
    )
    scene = replace(
        scene,
        time_s=time_s,
        bodies=bodies,
        articulations=articulations,
        lights=lights,
        instances=_moved_instances(scene, bodies, changes, time_s),
    )
    return place_sensors(scene)


def place_sensors(scene: Scene) -> Scene:
    """The scene with the poses of all sensors on their rigs or cameras, rounded as in files."""
    scene = replace(scene, cameras=tuple(_placed_camera(scene, c) for c in scene.cameras))
    return replace(
        scene,
        lidars=tuple(_placed_lidar(scene, lidar) for lidar in scene.lidars),
        devices=tuple(_placed_device(scene, device) for device in scene.devices),
    )


def moving_bodies(scene: Scene) -> frozenset[str]:
    """Names of bodies that do not stay where they are, also in a still image.

    They have a trajectory, drive (objects on driving or bicycle lanes), or belong to a person who
    is not sitting.
    """
    tracked = {track.body for track in scene.tracks}
    driven = {group.name for group in scene.groups if _DRIVEN & set(group.lanes)}
    afoot = {
        instance.instance_id
        for instance in scene.instances
        if dict(instance.attributes).get("behaviour", _SITTING) != _SITTING
    }
    return frozenset(
        body.name
        for body in scene.bodies
        if body.name in tracked or body.group in driven or body.instance_id in afoot
    )


def add_twists(scene: Scene) -> Scene:
    """The scene with the twists of all instances at the scene's instant."""
    tracks = {track.body: track for track in scene.tracks}
    if not tracks:
        return scene
    rooted = {a.instance_id for a in scene.articulations}
    carriers = {
        body.instance_id: tracks[body.name]
        for body in reversed(scene.bodies)
        if body.name in tracks and body.instance_id not in rooted
    }
    twists = {k: track.twist(scene.time_s) for k, track in carriers.items()}
    return replace(scene, instances=tuple(_set_twist(i, twists) for i in scene.instances))


def _set_twist(instance: Instance, twists: Mapping[int, Twist]) -> Instance:
    twist = twists.get(instance.instance_id, STILL)
    return instance if twist == instance.twist else replace(instance, twist=twist)


def ego_rig(scene: Scene, name: str = "") -> Rig | None:
    """The rig of that name; by default ``ego``, else the first one; None if there is none."""
    by_name = {rig.name: rig for rig in reversed(scene.rigs)}
    if name:
        return by_name.get(name)
    return by_name.get(EGO) or next(iter(scene.rigs), None)


def rig_twist(scene: Scene, rig: Rig) -> Twist:
    """Twist of a rig at the scene's instant, from the trajectory of the body that carries it."""
    track = scene.track(rig.body)
    if track is None:
        return STILL
    T_world_body = scene.body(rig.body).T_world_body
    arm_m = rotate_by_quaternion(T_world_body.quaternion_wxyz, rig.T_body_rig.translation_m)
    return track.carried_twist(scene.time_s, arm_m)


def _accumulate_changes(changes: tuple[StateChange, ...], time_s: float) -> dict[str, StateChange]:
    """``{body: all its changes up to an instant, combined}``."""
    sums: dict[str, StateChange] = {}
    for change in changes:
        if change.time_s > time_s + 1e-9:
            continue
        before = sums.get(change.body, change)
        facts = change.attributes
        if before.attributes != facts:
            facts = tuple(sorted({**dict(before.attributes), **dict(facts)}.items()))
        sums[change.body] = StateChange(
            change.time_s,
            change.body,
            change.asset or before.asset,
            change.materials or before.materials,
            facts,
        )
    return sums


def _apply_change(body: Body, change: StateChange | None) -> Body:
    if change is None:
        return body
    return replace(
        body, asset=change.asset or body.asset, materials=change.materials or body.materials
    )


def _moved_instances(
    scene: Scene, bodies: tuple[Body, ...], changes: dict[str, StateChange], time_s: float
) -> tuple[Instance, ...]:
    """Instances with the frames of their first bodies and the attributes of all."""
    rooted = {a.instance_id for a in scene.articulations}
    first: dict[int, Body] = {}
    facts: dict[int, dict[str, str]] = {}
    for body in bodies:
        first.setdefault(body.instance_id, body)
        if body.name in changes:
            facts.setdefault(body.instance_id, {}).update(changes[body.name].attributes)
    instances = []
    for instance in scene.instances:
        body_ = first.get(instance.instance_id)
        if body_ is None or instance.instance_id in rooted:
            instances.append(instance)
            continue
        change = changes.get(body_.name)
        still = body_.T_world_body == instance.T_world_instance
        if still and change is None and instance.instance_id not in facts:
            instances.append(instance)
            continue
        known = {**dict(instance.attributes), **facts.get(instance.instance_id, {})}
        instances.append(
            replace(
                instance,
                T_world_instance=body_.T_world_body,
                asset=(change.asset if change else "") or instance.asset,
                attributes=tuple(sorted(known.items())),
            )
        )
    return add_twists(replace(scene, time_s=time_s, instances=tuple(instances))).instances


def _moved_joints(arm: Articulation, time_s: float) -> Articulation:
    if arm.joint_track is None:
        return arm
    return replace(arm, joint_positions=arm.joint_track.positions(time_s))


def moved_light(light: Light, T_new_old: SE3) -> Light:
    """The light after a motion of its carrier, rounded as in files."""
    x, y, z = (T_new_old @ SE3(light.position_m)).translation_m
    dx, dy, dz = (float(v) for v in T_new_old.rotate(light.direction))  # type: ignore[arg-type]
    moved = replace(
        light,
        position_m=(round(x, 6), round(y, 6), round(z, 6)),
        direction=(round(dx, 8), round(dy, 8), round(dz, 8)),
    )
    if light.kind != "rectangle":
        return moved
    sx, sy, sz = (float(v) for v in T_new_old.rotate(light.side))  # type: ignore[arg-type]
    return replace(moved, side=(round(sx, 8), round(sy, 8), round(sz, 8)))


def _placed_camera(scene: Scene, camera: Camera) -> Camera:
    pose = camera.T_world_camera
    if camera.rig:
        pose = scene.rig_pose(camera.rig) @ camera.T_rig_camera
    return replace(camera, T_world_camera=pose.rounded())


def _placed_lidar(scene: Scene, lidar: Lidar) -> Lidar:
    T_world_rig = _rig_pose(scene, lidar.rig, lidar.camera)
    return replace(lidar, T_world_lidar=(T_world_rig @ lidar.T_rig_lidar).rounded())


def _placed_device(scene: Scene, device: Device) -> Device:
    T_world_rig = _rig_pose(scene, device.rig, device.camera)
    return replace(device, T_world_device=(T_world_rig @ device.T_rig_device).rounded())


def _rig_pose(scene: Scene, rig: str, camera: str) -> SE3:
    """``T_world_rig`` of a rig; of that at a camera if there is none."""
    return scene.rig_pose(rig) if rig else scene.camera(camera).T_world_camera @ RIG_AXES
