"""Test scenes in which bodies and the camera move uniformly."""

import math
from dataclasses import replace

from gen_data.core.asset_types import Material
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.motion import StateChange, Trajectory
from gen_data.core.scene import Body, Camera, Instance, Rig, Scene
from gen_data.core.scene_time import place_sensors, scene_at
from gen_data.core.se3 import IDENTITY, SE3, Vec3
from gen_data.core.shutter import INSTANT, Shutter
from tests.renderers.fake_library import DARK, FakeLibrary, box_mesh, plane_mesh

LENS = Intrinsics(96, 64, 80.0, 80.0, 48.0, 32.0)
STEP_S = 0.1
GLOWING = Material(base_color=(0.0, 0.0, 0.0), specular=0.0, emission_cd_m2=(100.0, 100.0, 100.0))
FACING = SE3((0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0))
"""Turns a plane towards a camera that looks along Z."""

MESHES = FakeLibrary({
    "box": box_mesh(), "lamp": box_mesh(materials=(GLOWING,)), "wall": plane_mesh(200.0),
    "speck": box_mesh((1e-3, 1e-3, 1e-3)),
})  # fmt: skip


def even_track(body: str, start: SE3, velocity_m_s: Vec3, turn_rad_s: float = 0.0) -> Trajectory:
    """A straight track from -1 s to 1 s through the start at 0, turning about the world's Y.

    Knots are close enough for turns to be even between them.
    """
    knots = []
    for k in range(-20, 21):
        time_s = k * 0.05
        half = 0.5 * turn_rad_s * time_s
        turned = SE3(quaternion_wxyz=(math.cos(half), 0.0, math.sin(half), 0.0)) @ replace(
            start, translation_m=(0.0, 0.0, 0.0)
        )
        x, y, z = (p + v * time_s for p, v in zip(start.translation_m, velocity_m_s, strict=True))
        knots.append(SE3((x, y, z), turned.quaternion_wxyz))
    return Trajectory(body, 0.05, tuple(knots), -1.0)


def world(
    *bodies: Body,
    tracks: tuple[Trajectory, ...] = (),
    changes: tuple[StateChange, ...] = (),
    camera_velocity_m_s: Vec3 = (0.0, 0.0, 0.0),
    camera_turn_rad_s: float = 0.0,
    lens: Intrinsics = LENS,
    shutter: Shutter = INSTANT,
    time_s: float = 0.2,
) -> Scene:
    """Bodies in front of a camera on a moving body; its frame is the world's at 0 s."""
    instances = tuple(
        Instance(b.instance_id, b.name, "thing", 1, b.asset, T_world_instance=b.T_world_body)
        for b in bodies
        if b.instance_id
    )
    ride = even_track("speck", IDENTITY, camera_velocity_m_s, camera_turn_rad_s)
    camera = Camera("camera", IDENTITY, lens, 5.0, rig="eye", shutter=shutter)
    scene = Scene(
        "moving",
        bodies=(*bodies, Body("speck", "speck", SE3((0.0, 0.0, -1.0)))),
        instances=instances,
        cameras=(camera,),
        rigs=(Rig("eye", "speck"),),
        environment=DARK,
        step_s=STEP_S,
        tracks=(*tracks, ride),
        changes=changes,
        time_s=-1.0,
    )
    return scene_at(place_sensors(scene), time_s)
