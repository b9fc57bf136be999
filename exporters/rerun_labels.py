"""Lanes, tracks, voxels, layers, mirrors and deliveries in recordings of the exporter ``rerun``.

They have the entities and colours of ``gen-data preview``. Rows are plain values, in the fragments
of shards; columns hold one entity, for the rows that have it.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core import serialization
from gen_data.core.capture import LAYERS, MIRRORED, Channel
from gen_data.core.sample import EgoTruth, ImageTruth, Occupancy, SensorTracks
from gen_data.core.scene import Scene
from gen_data.core.se3 import SE3
from gen_data.exporters import label_parts
from gen_data.exporters.image_files import depth_units, read_image
from gen_data.exporters.label_colors import color_ids, color_positions
from gen_data.exporters.png import RowFilter, encode_png

Row = Mapping[str, Any]
Entity = tuple[str, Sequence[Row], Any]
"""Path of an entity, the rows of samples that have values, and their columns."""
COLORED = {*LAYERS, *MIRRORED} - {Channel.DEPTH_LAYERS}
"""Channels of ids and places, which are coloured."""
LEVEL = 1
"""Of compression of images that are coloured or taken apart."""


def frame_row(frame: EgoTruth | None, scene: Scene) -> dict[str, Any]:
    """Labels of a sample as a whole, as far as it has them."""
    row: dict[str, Any] = {}
    if frame is None:
        return row
    if frame.borders:
        row["lanes"] = [[border.kind, border.points_m] for border in frame.borders]
    if frame.tracks is not None:
        row["tracks"] = frame.tracks.position_m.tolist()
    if frame.occupancy is not None:
        grid = frame.occupancy
        present = set(np.unique(grid.instance_id).tolist())
        categories = label_parts.categories_of(scene)
        plain = {
            name: serialization.to_plain(getattr(grid, name))
            for name in ("T_world_frame", "low_m", "voxel_m", "state", "instance_id", "surface")
        }
        row["occupancy"] = {
            "grid": {**plain, "observed": {}},
            "categories": {str(k): v for k, v in categories.items() if k in present},
        }
    return row


def image_row(truth: ImageTruth, tracks: SensorTracks | None) -> dict[str, Any]:
    """Lanes and tracked points in an image, as far as it has them."""
    row: dict[str, Any] = {}
    if truth.borders is not None:
        row["image_lanes"] = [
            (border.kind, seen, line)
            for border in truth.borders
            for seen, line in label_parts.split_border(border)
        ]
    if tracks is not None:
        shown = label_parts.inside_image(tracks)
        row["image_tracks"] = [
            shown.tolist(), tracks.image_px[shown].tolist(), tracks.visible[shown].tolist()
        ]  # fmt: skip
        row["tracks_count"] = len(tracks.state)
    return row


def frame_entities(rows: Sequence[Row]) -> Iterator[Entity]:
    """Entities of the world: ``lanes``, ``tracks``, ``occupancy`` and its ``voxels``."""
    import rerun as rr

    # Lanes change from sequence to sequence, not within one.
    lanes = [row.get("lanes", []) for row in rows]
    changed = [k for k, found in enumerate(lanes) if found != (lanes[k - 1] if k else [])]
    if changed:
        borders = [border for k in changed for border in lanes[k]]
        lift_m = (0.0, 0.0, label_parts.LIFT_M)
        columns = rr.LineStrips3D.columns(
            strips=[np.add(points_m, lift_m) for _, points_m in borders],
            colors=[label_parts.border_color(kind) for kind, _ in borders],
            radii=[-1.0] * len(borders),
        )
        counts = [len(lanes[k]) for k in changed]
        yield "world/lanes", [rows[k] for k in changed], columns.partition(counts)
    tracked = [row for row in rows if "tracks" in row]
    if tracked:
        counts = [len(row["tracks"]) for row in tracked]
        columns = rr.Points3D.columns(
            positions=[place for row in tracked for place in row["tracks"]],
            colors=[color for count in counts for color in label_parts.track_colors(count)],
        )
        yield "world/tracks", tracked, columns.partition(counts)
    filled = [row for row in rows if "occupancy" in row]
    if filled:
        yield from _voxel_entities(filled)


def _voxel_entities(rows: Sequence[Row]) -> Iterator[Entity]:
    import rerun as rr

    poses, sides_m, centers, colors = zip(*map(_voxels, rows), strict=True)
    w, *xyz = zip(*(pose.quaternion_wxyz for pose in poses), strict=True)
    frames = rr.Transform3D.columns(
        translation=[pose.translation_m for pose in poses], quaternion=np.stack([*xyz, w], axis=1)
    )
    yield "world/occupancy", rows, frames
    counts = [len(some) for some in centers]
    half_m = np.repeat(0.5 * np.array(sides_m, np.float32), counts)
    columns = rr.Boxes3D.columns(
        centers=np.concatenate(centers),
        half_sizes=np.repeat(half_m[:, None], 3, axis=1),
        colors=np.concatenate(colors),
    )
    yield "world/occupancy/voxels", rows, columns.partition(counts)
    solid = rr.Boxes3D.columns(fill_mode=[rr.components.FillMode.Solid] * len(rows))
    yield "world/occupancy/voxels", rows, solid


def _voxels(row: Row) -> tuple[SE3, float, NDArray[np.float32], NDArray[np.uint8]]:
    """Frame, side [m], centres [n, 3] and colours [n, 3] of the voxels with a surface."""
    grid = serialization.from_plain(Occupancy, row["occupancy"]["grid"])
    categories = {int(k): v for k, v in row["occupancy"]["categories"].items()}
    centers_m, colors = label_parts.surface_voxels(grid, categories)
    return grid.T_world_frame, grid.voxel_m, centers_m.astype(np.float32), colors


def image_entities(path: str, rows: Sequence[Row]) -> Iterator[Entity]:
    """Entities of an image: ``lanes`` and ``tracks``; hidden parts are darker or smaller."""
    import rerun as rr

    if any("image_lanes" in row for row in rows):
        parts = [row.get("image_lanes", ()) for row in rows]
        joined = [part for some in parts for part in some]
        columns = rr.LineStrips2D.columns(
            strips=[line for _, _, line in joined],
            colors=[label_parts.border_color(kind, visible=seen) for kind, seen, _ in joined],
            radii=[label_parts.BORDER_RADII[seen] for _, seen, _ in joined],
        )
        yield f"{path}/lanes", rows, columns.partition([len(some) for some in parts])
    tracked = [row for row in rows if "image_tracks" in row]
    if tracked:
        numbers, places, visible = (
            [value for row in tracked for value in row["image_tracks"][k]] for k in range(3)
        )
        colors = label_parts.track_colors(max(row["tracks_count"] for row in tracked))
        columns = rr.Points2D.columns(
            positions=places,
            colors=[colors[k] for k in numbers],
            radii=[label_parts.TRACK_RADII[seen] for seen in visible],
            class_ids=[0] * len(numbers),
            keypoint_ids=numbers,
        )
        counts = [len(row["image_tracks"][0]) for row in tracked]
        yield f"{path}/tracks", tracked, columns.partition(counts)


def channel_entities(
    camera: str, channel: Channel, rows: Sequence[Row], paths: Iterable[Path], depth_scale_m: float
) -> Iterator[Entity]:
    """Entities of a channel of layers, one of each layer, or of the instances in mirrors.

    Depth is below the camera's image, as other depths; ids and places are coloured, in a view each.
    Places are points in the world, too.
    """
    import rerun as rr

    decoded = (
        read_image(path, channel, depth_scale_m, tuple(row["size"]))
        for path, row in zip(paths, rows, strict=True)
    )
    if channel is Channel.MIRRORED_POSITION:
        yield from _mirrored_entities(camera, rows, decoded)
        return
    images = list(decoded)
    if channel is Channel.DEPTH_LAYERS:
        root = f"world/cameras/{camera}/image/{channel.value}"
        for suffix, layers in _layers(images):
            units = [depth_units(layer_m, depth_scale_m) for layer_m in layers]
            blobs = [encode_png(pixels, RowFilter.SUB, LEVEL) for pixels in units]
            columns = rr.EncodedDepthImage.columns(
                blob=[np.frombuffer(blob, np.uint8) for blob in blobs],
                media_type=["image/png"] * len(blobs),
                meter=[1.0 / depth_scale_m] * len(blobs),
            )
            yield f"{root}{suffix}", rows, columns
        return
    root = f"channels/{camera}/{channel.value}"
    for suffix, layers in _layers(images) if channel in LAYERS else [("", images)]:
        yield f"{root}{suffix}", rows, _colored_columns(map(color_ids, layers))


def _mirrored_entities(
    camera: str, rows: Sequence[Row], images: Iterable[NDArray[Any]]
) -> Iterator[Entity]:
    """Coloured images of places in mirrors, and some of their points in the world."""
    import rerun as rr

    pictures, found = [], []
    for position_m in images:
        pictures.append(color_positions(position_m))
        found.append(label_parts.mirrored_points(position_m, pictures[-1]))
    yield f"channels/{camera}/mirrored_position", rows, _colored_columns(pictures)
    places_m, colors = (np.concatenate(parts) for parts in zip(*found, strict=True))
    if len(places_m):
        columns = rr.Points3D.columns(positions=places_m, colors=colors)
        counts = [len(places) for places, _ in found]
        yield f"world/mirrored/{camera}", rows, columns.partition(counts)


def _colored_columns(pictures: Iterable[NDArray[np.uint8]]) -> Any:
    import rerun as rr

    blobs = [encode_png(picture, RowFilter.UP, LEVEL) for picture in pictures]
    return rr.EncodedImage.columns(
        blob=[np.frombuffer(blob, np.uint8) for blob in blobs],
        media_type=["image/png"] * len(blobs),
    )


def delivery_entities(sensor: str, rows: Sequence[Row]) -> Iterator[Entity]:
    """Numbers over time of a sensor with faults of delivery: ``arrivals`` and ``late_s``."""
    import rerun as rr

    known = [row for row in rows if "delivery" in row]
    if known:
        for k, name in enumerate(("arrivals", "late_s")):
            numbers = [float(row["delivery"][k]) for row in known]
            yield f"delivery/{sensor}/{name}", known, rr.Scalars.columns(scalars=numbers)


def _layers(images: Sequence[NDArray[Any]]) -> Iterator[tuple[str, list[NDArray[Any]]]]:
    """Ending of the entity of each layer, and its images, [h, w]; all have as many layers."""
    for number in range(images[0].shape[-1]):
        yield f"/{number}", [np.ascontiguousarray(image[..., number]) for image in images]
