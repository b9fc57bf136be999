"""Conversion of frames, meshes, boxes and trajectories to Rerun's archetypes.

Rerun's conventions: quaternions are x y z w, boxes have half sizes; a pinhole's principal point is
as in this project (pixel centres at i + 0.5).
"""

from __future__ import annotations

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from gen_data.generator.core.asset_types import MeshData
from gen_data.generator.core.boxes import OrientedBox
from gen_data.generator.core.intrinsics import Intrinsics
from gen_data.generator.core.sample import ImageTruth, Sample
from gen_data.generator.core.scene import Instance, Scene
from gen_data.generator.core.se3 import SE3
from gen_data.generator.preview.palette import id_color

WAY_M = 0.1
"""Shortest trajectory to show."""
LIFT_M = 0.05
"""Height of trajectories above the path of a body's origin."""


def transform(pose: SE3, scale: float = 1.0) -> rr.Transform3D:
    """Convert a pose, with an optional scale of its children."""
    return rr.Transform3D(
        translation=pose.translation_m,
        quaternion=rr.Quaternion(xyzw=_xyzw(pose)),
        scale=scale if scale != 1.0 else None,
    )


def pinhole(camera: Intrinsics) -> rr.Pinhole:
    """Convert a pinhole camera: X right, Y down, Z forward."""
    return rr.Pinhole(
        image_from_camera=camera.matrix(),
        width=camera.width_px,
        height=camera.height_px,
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=0.15,
    )


def mesh_3d(mesh: MeshData, slot_colors: NDArray[np.uint8]) -> rr.Mesh3D:
    """Convert a mesh with one sRGB colour per material slot, [slots, 3]."""
    corners = mesh.faces.reshape(-1)
    slots = np.repeat(mesh.face_slots, 3)
    return rr.Mesh3D(
        vertex_positions=mesh.vertices_m[corners],
        vertex_normals=mesh.normals[corners],
        vertex_colors=slot_colors[slots],
        triangle_indices=np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
    )


def boxes_3d(sample: Sample) -> rr.Boxes3D:
    """World boxes of all objects visible to any camera, by instance id."""
    found: dict[int, tuple[Instance, OrientedBox]] = {
        item.instance.instance_id: (item.instance, item.box3d_world)
        for truth in sample.truth.values()
        for item in truth.objects
        if item.box3d_world is not None
    }
    boxes = [found[key] for key in sorted(found)]
    return rr.Boxes3D(
        centers=[box.T_frame_box.translation_m for _, box in boxes],
        half_sizes=[[0.5 * s for s in box.size_m] for _, box in boxes],
        quaternions=[_xyzw(box.T_frame_box) for _, box in boxes],
        labels=[instance.category for instance, _ in boxes],
        class_ids=[instance.category_id for instance, _ in boxes],
    )


def boxes_2d(truth: ImageTruth) -> rr.Boxes2D:
    """Image boxes of all visible objects."""
    items = [item for item in truth.objects if item.box is not None]
    return rr.Boxes2D(
        mins=[(item.box.x_min, item.box.y_min) for item in items if item.box],
        sizes=[(item.box.width_px, item.box.height_px) for item in items if item.box],
        labels=[item.instance.category for item in items],
        class_ids=[item.instance.category_id for item in items],
    )


def trajectory_strips(scene: Scene, until_s: float) -> rr.LineStrips3D:
    """Trajectories of bodies from now to an instant, coloured by category; rigs in white."""
    categories = {i.instance_id: i.category_id for i in scene.instances}
    carriers = {rig.body for rig in scene.rigs}
    strips, colors = [], []
    for track in scene.tracks:
        steps = max(2, round((until_s - scene.time_s) / track.step_s) + 1)
        times_s = np.linspace(scene.time_s, until_s, steps)
        _, places_m = track.poses(times_s)
        if float(np.ptp(places_m, axis=0).max()) < WAY_M:
            continue
        category_id = categories.get(scene.body(track.body).instance_id, 0)
        strips.append(np.add(places_m, (0.0, 0.0, LIFT_M)))
        carries = track.body in carriers or not category_id
        colors.append((255, 255, 255) if carries else id_color(category_id))
    return rr.LineStrips3D(strips, colors=colors, radii=rr.Radius.ui_points(1.5))


def _xyzw(pose: SE3) -> tuple[float, float, float, float]:
    w, x, y, z = pose.quaternion_wxyz
    return (x, y, z, w)
