"""Images of the sample browser: small JPEGs, with overlays as data that the page draws."""

import base64
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core import boxes, capture, skeletons
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import ImageTruth, KeypointTruth, ObjectTruth
from gen_data.exporters import label_parts
from gen_data.exporters.label_colors import Rgb
from gen_data.preview import overlay, palette, voxel_view
from gen_data.report.occupancy_statistics import grid_facts
from gen_data.runner.stored import LabelledImages, StoredSamples

WIDTH_PX = 640
"""Largest width of an image in the page."""
JPEG_QUALITY = 82
IMAGES_MAX = 96
POINTS_MAX = 3000
"""Largest number of laser points shown in an image, chosen evenly."""
MASKS_MAX = 255
"""Masks of an image are the values of an 8-bit image."""
PIECES = 12
"""Number of straight pieces that show an edge of a box."""
NEAR_M = 0.01
"""Points nearer to the camera plane than this have no place in a straight image."""
DRAWN = ("points", "lanes", "tracks")
"""Facts about an image that the page draws, and its figures do not contain."""
FAR_LOG_M = (1.0, 100.0)
"""Ends of the logarithmic colour scale of laser points."""

LAYERS = (*capture.LAYERS, capture.Channel.SEEN_IN_MIRROR)

DEPTHS = (capture.Channel.Z_DEPTH, capture.Channel.RANGE, capture.Channel.MEASURED_DEPTH)


@dataclass(frozen=True, slots=True)
class BrowserImage:
    """One image for the browser: plain JSON values, and pictures as ``data:`` URLs.

    Attributes:
        facts: Index, camera, size and labels.
        pictures: ``rgb``, and ``depth``, ``masks``, ``occupancy`` and ``layers`` if there are any.
            A pixel of ``masks`` is the number of its object in ``facts["objects"]``, from 1; 0 =
            none. ``occupancy`` is the sample's, from above, with X upwards. ``layers`` has
            layers of depth, ids and materials, and mirrors, one below the other.
    """

    facts: dict[str, Any]
    pictures: dict[str, str]

    @property
    def bytes(self) -> int:
        """Size of the pictures, points and lines in the page."""
        drawn = (str(self.facts.get(name, "")) for name in DRAWN)
        return sum(map(len, (*self.pictures.values(), *drawn)))


def browser_images(stored: StoredSamples, bytes_max: int) -> list[BrowserImage]:
    """Images that are spread evenly over a data set, in its order.

    Images are numbered by sample and camera, and taken in the order of the bit-reversed numbers,
    whose first ones are spread evenly, until there are ``IMAGES_MAX`` or the limit is reached.

    Args:
        stored: A finished data set.
        bytes_max: Limit of the size of all pictures in the page.

    Raises:
        StorageError: a file of an image is missing or damaged.
    """
    cameras = [c for c in stored.info.cameras if capture.Channel.RGB in stored.info.media[c]]
    taken: list[BrowserImage] = []
    size = 0
    for number in evenly_spread(stored.n * len(cameras)):
        index, camera = divmod(number, len(cameras))
        sample = stored.labelled(stored.indices[index])
        name = cameras[camera]
        if name not in sample.truth:
            continue
        image = _browser_image(sample, name)
        size += image.bytes
        if len(taken) == IMAGES_MAX or size > bytes_max:
            break
        taken.append(image)
    return sorted(taken, key=lambda image: (image.facts["index"], image.facts["camera"]))


def evenly_spread(count: int) -> Iterator[int]:
    """Yield all numbers below ``count`` in an order whose every beginning is spread evenly.

    It is the order of van der Corput's sequence in base 2.
    """
    bits = max(count - 1, 0).bit_length()
    for k in range(1 << bits):
        number = int(f"{k:0{bits}b}"[::-1], 2) if bits else 0
        if number < count:
            yield number


def thumbnail(path: Any, width_px: int) -> str:
    """``data:`` URL of a small JPEG of an image file; empty if the file cannot be read."""
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if image is None:
        return ""
    return _jpeg(_shrink(np.asarray(image, np.uint8), width_px, cv2.INTER_AREA), 70)


def _browser_image(sample: LabelledImages, camera: str) -> BrowserImage:
    reading, truth = sample.capture.readings[camera], sample.truth[camera]
    rgb = np.asarray(reading.channels[capture.Channel.RGB], np.uint8)
    pictures = {"rgb": _jpeg(_shrink(rgb[..., ::-1], WIDTH_PX, cv2.INTER_AREA), JPEG_QUALITY)}
    depth = next((c for c in DEPTHS if c in reading.channels), None)
    if depth is not None:
        grey = palette.color_depth(reading.channels[depth])
        pictures["depth"] = _jpeg(_shrink(grey, WIDTH_PX, cv2.INTER_NEAREST), JPEG_QUALITY)
    masks = _mask_image(reading, truth)
    if masks is not None:
        pictures["masks"] = _png(_shrink(masks, WIDTH_PX, cv2.INTER_NEAREST))
    facts: dict[str, Any] = {
        "index": sample.index,
        "camera": camera,
        "split": sample.split,
        "size_px": [rgb.shape[1], rgb.shape[0]],
        "objects": [_object(item, truth.camera.intrinsics) for item in truth.objects],
    }
    points = _laser_points(sample, truth)
    if points:
        facts["points"] = points
    facts |= _lanes_and_tracks(sample, camera)
    layers = [channel for channel in LAYERS if channel in reading.channels]
    if layers:
        facts["layers"] = [channel.value for channel in layers]
        pictures["layers"] = _jpeg(_layer_pictures(reading, layers), JPEG_QUALITY)
    grid = None if sample.frame is None else sample.frame.occupancy
    if grid is not None:
        facts["occupancy"] = grid_facts(grid)
        above = voxel_view.view_from_above(grid, sample.scene)
        pictures["occupancy"] = _png(_shrink(above[..., ::-1], WIDTH_PX, cv2.INTER_NEAREST))
    return BrowserImage(facts, pictures)


def _lanes_and_tracks(sample: LabelledImages, camera: str) -> dict[str, Any]:
    """Borders of lanes and tracked points in an image, in whole pixels; empty without both.

    Parts of borders are [colour, visible, [x, y, x, y, ...]], points [colour, visible, x, y].
    """
    facts: dict[str, Any] = {}
    borders = sample.truth[camera].borders or ()
    if borders:
        facts["lanes"] = [
            [
                _hex(label_parts.border_color(b.kind)),
                seen,
                np.rint(line).astype(int).ravel().tolist(),
            ]
            for b in borders
            for seen, line in label_parts.split_border(b)
        ]
    tracks = sample.frame.tracks if sample.frame is not None else None
    if tracks is not None and camera in tracks.sensors:
        points = tracks.sensors[camera]
        colors = label_parts.track_colors(len(points.state))
        facts["tracks"] = [
            [
                _hex(colors[k]),
                bool(points.visible[k]),
                *np.rint(points.image_px[k]).astype(int).tolist(),
            ]
            for k in label_parts.inside_image(points).tolist()
        ]
    return facts


def _hex(color: Rgb) -> str:
    return "#{:02x}{:02x}{:02x}".format(*color)


def _layer_pictures(
    reading: capture.SensorReading, channels: Sequence[capture.Channel]
) -> NDArray[np.uint8]:
    """Layers and mirrors in their colours, one below the other, BGR."""
    images = [
        image
        for channel in channels
        for image in (
            overlay.layer_images(reading, channel)
            if channel in capture.LAYERS
            else [overlay.channel_image(reading, channel)]
        )
    ]
    small = [_shrink(image[..., ::-1], WIDTH_PX // 2, cv2.INTER_NEAREST) for image in images]
    return np.concatenate(small)


def _object(item: ObjectTruth, intrinsics: Intrinsics) -> dict[str, Any]:
    facts: dict[str, Any] = {
        "category": item.instance.category,
        "instance": item.instance.instance_id,
        "visible_px": item.visible_px,
    }
    if item.box is not None:
        b = item.box
        facts["box"] = [b.x_min, b.y_min, b.x_max, b.y_max]
    for name in ("visible_fraction", "occlusion", "truncation"):
        value = getattr(item, name)
        if value is not None:
            facts[name] = round(value, 3)
    if item.box3d_camera is not None:
        center_m = item.box3d_camera.T_frame_box.translation_m
        facts["distance_m"] = round(float(np.linalg.norm(center_m)), 2)
        facts["edges"] = _edges(item.box3d_camera, intrinsics)
    if item.keypoints:
        facts["keypoints"], facts["bones"] = _keypoints(item.keypoints)
    if item.lidar_points:
        facts["lidar_points"] = sum(item.lidar_points.values())
    return facts


def _keypoints(points: Sequence[KeypointTruth]) -> tuple[list[list[float]], list[list[int]]]:
    """Image coordinates and visibility of all points, and pairs of numbers of joined ones."""
    numbers = {point.name: k for k, point in enumerate(points)}
    skeleton = skeletons.find_skeleton(numbers)
    ends = [(skeleton.names[a], skeleton.names[b]) for a, b in skeleton.bones]
    bones = [[numbers[a], numbers[b]] for a, b in ends if a in numbers and b in numbers]
    places = [[*(round(v, 1) for v in p.image_px), p.visibility] for p in points]
    return places, bones


def _edges(box: boxes.OrientedBox, intrinsics: Intrinsics) -> list[list[int]]:
    """Polylines [x, y, x, y, ...] of the visible parts of a box's edges, in whole pixels."""
    corners_m = box.corners()
    share = np.linspace(0.0, 1.0, PIECES + 1)[:, None]
    lines: list[list[int]] = []
    for a, b in overlay.BOX_EDGES:
        places_m = corners_m[a] + (corners_m[b] - corners_m[a]) * share
        if intrinsics.straight:
            places_m = places_m[places_m[:, 2] > NEAR_M]
            places_m = places_m[[0, -1]] if len(places_m) > 1 else places_m[:0]
        longest_px = np.inf if intrinsics.straight else 0.5 * intrinsics.width_px
        lines += _polylines(intrinsics.project(places_m), longest_px)
    return lines


def _polylines(places_px: NDArray[np.float64], longest_px: float) -> Iterator[list[int]]:
    """Yield the parts of a line between points without an image and longer pieces (seams)."""
    line: list[int] = []
    for (u, v), (next_u, next_v) in pairwise(np.clip(places_px, -1e4, 1e4).tolist()):
        if not np.isfinite([u, v, next_u, next_v]).all() or abs(next_u - u) > longest_px:
            if line:
                yield line
            line = []
            continue
        line = line or [round(u), round(v)]
        line += [round(next_u), round(next_v)]
    if line:
        yield line


def _mask_image(reading: capture.SensorReading, truth: ImageTruth) -> NDArray[np.uint8] | None:
    """Number of each pixel's object, uint8 [h, w]; None without masks and instance ids."""
    height, width = truth.camera.intrinsics.height_px, truth.camera.intrinsics.width_px
    image: NDArray[np.uint8] = np.zeros((height, width), np.uint8)
    masked = False
    ids = None
    if capture.Channel.INSTANCE in reading.channels:
        ids = np.asarray(reading.channels[capture.Channel.INSTANCE])
    for number, item in enumerate(truth.objects[:MASKS_MAX], 1):
        if item.mask is not None:
            rows, columns = item.mask.pixels.shape
            window = image[item.mask.y_px :, item.mask.x_px :][:rows, :columns]
            window[item.mask.pixels] = number
            masked = True
        elif ids is not None:
            image[ids == item.instance.instance_id] = number
            masked = True
    return image if masked else None


def _laser_points(sample: LabelledImages, truth: ImageTruth) -> str:
    """Laser points in an image: base64 of uint16 rows (x px, y px, colour), empty without any.

    The colour is a 12-bit RGB value, four bits each, from blue (near) to red (far).
    """
    T_camera_world = truth.camera.T_world_camera.inverse()
    places, ranges = [np.zeros((0, 2))], [np.zeros(0)]
    for cloud in sample.capture.clouds.values():
        position_m = cloud.points["position_m"].astype(np.float64)
        seen_m = (T_camera_world @ cloud.lidar.T_world_lidar).apply(position_m)
        places.append(truth.camera.intrinsics.project(seen_m))
        ranges.append(np.linalg.norm(seen_m, axis=1))
    place, range_m = np.concatenate(places), np.concatenate(ranges)
    size_px = (truth.camera.intrinsics.width_px, truth.camera.intrinsics.height_px)
    shown = np.flatnonzero(((place >= 0) & (place < size_px)).all(axis=1))
    if not shown.size:
        return ""
    shown = shown[:: -(-shown.size // POINTS_MAX)]
    low, high = np.log(FAR_LOG_M)
    share = (np.log(np.maximum(range_m[shown], 1e-3)) - low) / (high - low)
    red, green, blue = (palette.color_shares(share) >> 4).astype(np.uint16).T
    rows = np.column_stack([place[shown].astype(np.uint16), red << 8 | green << 4 | blue])
    return base64.b64encode(rows.astype("<u2").tobytes()).decode()


def _shrink(image: NDArray[np.uint8], width_px: int, interpolation: int) -> NDArray[np.uint8]:
    height, width = image.shape[:2]
    if width <= width_px:
        return np.ascontiguousarray(image)
    size_px = (width_px, max(1, round(height * width_px / width)))
    shrunk: NDArray[np.uint8] = np.asarray(
        cv2.resize(np.ascontiguousarray(image), size_px, interpolation=interpolation), np.uint8
    )
    return shrunk


def _jpeg(bgr: NDArray[np.uint8], quality: int) -> str:
    _, data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode()


def _png(pixels: NDArray[np.uint8]) -> str:
    """``data:`` URL of a grey or BGR image."""
    _, data = cv2.imencode(".png", pixels)
    return "data:image/png;base64," + base64.b64encode(data.tobytes()).decode()
