"""``tracklet_labels.xml``: the 3D boxes of a recording of KITTI's raw data, object by object.

A tracklet spans the first to the last frame in which its object is visible; boxes of hidden frames
in between are included. Poses are in the frame of the scans (``gen_data.exporters.velodyne``): the
centre of the bottom face, and the rotation about Z. A tracklet has one size, the largest of its
object (people swing their arms).

Reference: element names and states follow KITTI's raw data development kit (``tracklets.h``), which
reads the file with Boost.Serialization.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gen_data.core.boxes import OrientedBox
from gen_data.core.sample import ImageTruth, ObjectTruth, Sample
from gen_data.core.se3 import IDENTITY
from gen_data.exporters import kitti, pointclouds, velodyne

INTERPOLATED, LABELLED = 1, 2
"""States of a box: not visible in this frame; visible."""
OCCLUSION_UNSET = 255
IN_IMAGE, TRUNCATED, OUT_OF_IMAGE, BEHIND_IMAGE = range(4)
TRUNCATED_SHARE = 0.02
"""Fraction of the silhouette outside the image above which a box counts as truncated."""

_HEAD = """\
<?xml version="1.0" encoding="UTF-8" standalone="yes" ?>
<!DOCTYPE boost_serialization>
<boost_serialization signature="serialization::archive" version="9">
"""
_UNKNOWN = "".join(
    f"<{name}>-1</{name}>"
    for name in ("amt_occlusion", "amt_occlusion_kf", "amt_border_l", "amt_border_r")
)


def frame_boxes(
    sample: Sample, camera: str, lidar: str, turn: velodyne.Turn
) -> list[dict[str, Any]]:
    """Boxes of all annotated objects of one frame, by instance id, as JSON values.

    Args:
        sample: The frame.
        camera: Camera 02.
        lidar: Laser scanner.
        turn: Turn of its frame to the frame of its files.
    """
    truth = sample.truth[camera]
    seen = {thing.instance.instance_id: thing for thing in truth.objects}
    T_camera_lidar = truth.camera.T_world_camera.inverse() @ sample.scene.lidar(lidar).T_world_lidar
    T_velo_lidar = velodyne.turned_pose(IDENTITY, turn).inverse()
    return [
        {
            "id": instance.instance_id,
            "type": kitti.official_type(instance),
            "size_m": [round(v, 6) for v in box.size_m],
            "pose": _pose(box.seen_from(T_velo_lidar)),
            **_visibility(seen.get(instance.instance_id), box.seen_from(T_camera_lidar), truth),
        }
        for instance, box in pointclouds.lidar_boxes(sample, lidar)
    ]


def tracklets_text(frames: Sequence[Sequence[Mapping[str, Any]]]) -> str:
    """Format the file.

    Args:
        frames: Results of ``frame_boxes``, frame by frame.
    """
    ways: dict[int, list[tuple[int, Mapping[str, Any]]]] = {}
    for number, boxes in enumerate(frames):
        for box in boxes:
            ways.setdefault(box["id"], []).append((number, box))
    kept = [_trim_to_visible(ways[key]) for key in sorted(ways)]
    kept = [way for way in kept if way]
    body = "".join(_tracklet(way, first=k == 0) for k, way in enumerate(kept))
    count = f"<count>{len(kept)}</count>\n<item_version>1</item_version>\n"
    head = _HEAD + '<tracklets class_id="0" tracking_level="0" version="0">\n' + count
    return head + body + "</tracklets>\n</boost_serialization>\n"


def _trim_to_visible(
    way: Sequence[tuple[int, Mapping[str, Any]]],
) -> Sequence[tuple[int, Mapping[str, Any]]]:
    """Keep the first to the last visible frame; empty if there is none."""
    shown = [k for k, (_, box) in enumerate(way) if box["state"] == LABELLED]
    return way[shown[0] : shown[-1] + 1] if shown else ()


def _tracklet(way: Sequence[tuple[int, Mapping[str, Any]]], *, first: bool) -> str:
    # Boost writes the version of a class at its first occurrence.
    marks = [
        f' class_id="{k}" tracking_level="0" version="{v}"' if first else ""
        for k, v in ((1, 1), (2, 0), (3, 2))
    ]
    sizes_m = np.array([box["size_m"] for _, box in way]).max(axis=0)
    length, width, height = (f"{v:.6f}" for v in sizes_m)
    items = "".join(_item(box, marks[2] if k == 0 else "") for k, (_, box) in enumerate(way))
    return (
        f"<item{marks[0]}>\n<objectType>{way[0][1]['type']}</objectType>\n"
        f"<h>{height}</h><w>{width}</w><l>{length}</l>\n"
        f"<first_frame>{way[0][0]}</first_frame>\n<poses{marks[1]}>\n"
        f"<count>{len(way)}</count>\n<item_version>2</item_version>\n{items}"
        "</poses>\n<finished>1</finished>\n</item>\n"
    )


def _item(box: Mapping[str, Any], mark: str) -> str:
    tx, ty, tz, rz = (f"{v:.6f}" for v in box["pose"])
    return (
        f"<item{mark}><tx>{tx}</tx><ty>{ty}</ty><tz>{tz}</tz><rx>0</rx><ry>0</ry><rz>{rz}</rz>"
        f"<state>{box['state']}</state><occlusion>{box['occlusion']}</occlusion>"
        f"<occlusion_kf>-1</occlusion_kf><truncation>{box['truncation']}</truncation>"
        f"{_UNKNOWN}<amt_border_kf>-1</amt_border_kf></item>\n"
    )


def _pose(box: OrientedBox) -> list[float]:
    """Centre of the bottom face and rotation about Z, in the frame of the box's pose."""
    rotation = box.T_frame_box.rotation()
    x, y, z = box.T_frame_box.apply(np.array([0.0, 0.0, -0.5 * box.size_m[2]]))
    yaw_rad = math.atan2(rotation[1, 0], rotation[0, 0])
    return [round(float(v), 6) + 0.0 for v in (x, y, z, yaw_rad)]


def _visibility(
    thing: ObjectTruth | None, box_camera: OrientedBox, truth: ImageTruth
) -> dict[str, int]:
    if thing is None or thing.box is None or thing.ignored:
        uv = truth.camera.intrinsics.project(np.array(box_camera.T_frame_box.translation_m))
        k = truth.camera.intrinsics
        if not np.isfinite(uv).all():
            return {"state": INTERPOLATED, "occlusion": OCCLUSION_UNSET, "truncation": BEHIND_IMAGE}
        inside = 0 <= uv[0] < k.width_px and 0 <= uv[1] < k.height_px
        occlusion, truncation = (2, IN_IMAGE) if inside else (OCCLUSION_UNSET, OUT_OF_IMAGE)
        return {"state": INTERPOLATED, "occlusion": occlusion, "truncation": truncation}
    assert thing.occlusion is not None, "the annotation visibility is in `needs`"
    assert thing.truncation is not None, "the annotation visibility is in `needs`"
    cut = TRUNCATED if thing.truncation > TRUNCATED_SHARE else IN_IMAGE
    return {
        "state": LABELLED,
        "occlusion": kitti.occlusion_level(thing.occlusion),
        "truncation": cut,
    }
