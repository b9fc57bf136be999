"""Drawing of labels on images: tinted or outlined masks, boxes, skeletons and names."""

from collections.abc import Callable, Collection, Mapping, Sequence
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core import boxes, capture, sample, skeletons
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.intrinsics import Intrinsics
from gen_data.exporters.label_colors import Rgb, color_ids, color_positions, id_color
from gen_data.preview.palette import color_depth, color_flow, grey_infrared

Image = NDArray[np.uint8]

BOX_EDGES = (
    (0, 1), (0, 2), (0, 4), (3, 1), (3, 2), (3, 7), (5, 1), (5, 4), (5, 7), (6, 2), (6, 4), (6, 7),
)  # fmt: skip
"""Pairs of ``OrientedBox.corners`` that share an edge."""

PIECES = 32
"""Number of pieces of an edge that a lens bends."""
SURROUNDINGS = frozenset({"wall", "floor", "ceiling"})
"""Categories that are outlined, as all that is in the scene stands before them."""
SURROUNDING_SHARE = 0.2
"""Share of the image from which any object is outlined."""
FONT_SIZE = 0.42
"""Of OpenCV: capitals of 9 px."""
NEAR_M = 0.01
"""Edges are clipped at this distance from the camera plane."""


LAYERS = ("masks", "boxes3d", "boxes", "keypoints", "names")
"""Kinds of labels, in the order of drawing."""


def draw_labels(
    reading: SensorReading,
    truth: sample.ImageTruth,
    unit: float = 1.0,
    layers: Collection[str] = LAYERS,
) -> Image:
    """Draw labels on the RGB image, uint8 [h, w, 3].

    Surroundings of the scene, such as walls and floors, are outlined and named only.

    Args:
        reading: Reading of the camera.
        truth: Its labels.
        unit: Width of lines [px]; names have ten times its height. For an image that is shown at a
            third of its size, 3.
        layers: Kinds to draw, some of ``LAYERS``.
    """
    image: Image = np.array(reading.channels[Channel.RGB], np.uint8, order="C")
    width = max(1, round(unit))
    around = [item for item in truth.objects if _surrounds(image, item)]
    things = [item for item in truth.objects if not _surrounds(image, item)]
    if "masks" in layers:
        for item in things:
            _tint(image, item)
        for item in around:
            _outline(image, item, width)
    for item in things:
        color = id_color(item.instance.instance_id)
        if "boxes3d" in layers and item.box3d_camera is not None:
            draw_box3d(image, item.box3d_camera, truth.camera.intrinsics, color, width)
        if "boxes" in layers and item.box is not None:
            b = item.box
            cv2.rectangle(image, (b.x_min, b.y_min), (b.x_max - 1, b.y_max - 1), color, width)
        if "keypoints" in layers:
            draw_keypoints(image, item.keypoints or (), _lighter(color))
    places: list[boxes.BoxPx] = []
    # Names of objects first: names of their surroundings make room.
    for item in (*things, *around) if "names" in layers else ():
        if item.box is not None:
            _write(image, item, unit, places)
    return image


def channel_image(reading: SensorReading, channel: Channel) -> Image:
    """Convert any channel to a visible image, uint8 [h, w, 3]; layers are side by side.

    Raises:
        KeyError: the reading does not have the channel.
    """
    image = reading.channels[channel]
    if channel in capture.LAYERS:
        image = np.concatenate(np.moveaxis(image, -1, 0), axis=1)
    return _SHOWN[channel](image) if channel in _SHOWN else color_ids(image)


def layer_images(reading: SensorReading, channel: Channel) -> list[Image]:
    """The visible image of each layer of a channel, in colours that are the same in all of them."""
    return np.split(channel_image(reading, channel), reading.channels[channel].shape[-1], axis=1)


def _disparity(disparity_px: NDArray[Any]) -> Image:
    nothing = np.full_like(disparity_px, np.inf)
    return color_depth(np.divide(1.0, disparity_px, out=nothing, where=disparity_px > 0))


def _flow_from_above(scene_flow_m: NDArray[Any]) -> Image:
    """Colour the components to the right and away from the camera."""
    return color_flow(np.stack([scene_flow_m[..., 0], -scene_flow_m[..., 2]], axis=-1))


def _white_where_set(flags: NDArray[Any]) -> Image:
    return np.repeat(flags[..., None] * np.uint8(255), 3, axis=2)


_SHOWN: Mapping[Channel, Callable[[NDArray[Any]], Image]] = {
    Channel.RGB: lambda image: np.asarray(image, np.uint8),
    Channel.Z_DEPTH: color_depth,
    Channel.RANGE: color_depth,
    Channel.MEASURED_DEPTH: color_depth,
    Channel.DEPTH_LAYERS: color_depth,
    Channel.DISPARITY: _disparity,
    Channel.DISPARITY_VISIBLE: _disparity,
    Channel.INFRARED: grey_infrared,
    Channel.NORMALS: lambda normals: np.round((normals + 1.0) * 127.5).astype(np.uint8),
    Channel.OBJECT_COORDINATES: lambda places: np.round(places * 255.0).astype(np.uint8),
    Channel.MIRRORED_POSITION: color_positions,
    Channel.FLOW_FORWARD: color_flow,
    Channel.FLOW_BACKWARD: color_flow,
    Channel.SCENE_FLOW: _flow_from_above,
    Channel.FLOW_OCCLUDED_FORWARD: _white_where_set,
    Channel.FLOW_OCCLUDED_BACKWARD: _white_where_set,
}
"""Conversions of channels to visible images; all other channels are ids."""


def draw_box3d(
    image: Image, box: boxes.OrientedBox, intrinsics: Intrinsics, color: Rgb, width: int = 1
) -> None:
    """Draw the edges of a box given in the camera frame into ``image``, in place."""
    corners = box.corners()
    if not intrinsics.straight:
        for a, b in BOX_EDGES:
            _draw_bent(image, corners[a], corners[b], intrinsics, color, width)
        return
    for a, b in BOX_EDGES:
        segment = _in_front(corners[a], corners[b])
        if segment is not None:
            _draw_line(image, intrinsics.project(segment), color, width)


def _draw_bent(
    image: Image, a: NDArray[Any], b: NDArray[Any], intrinsics: Intrinsics, color: Rgb, width: int
) -> None:
    """Draw a segment in pieces, without pieces outside of the lens's field or across a seam."""
    share = np.linspace(0.0, 1.0, PIECES + 1)[:, None]
    places = intrinsics.project(a + (b - a) * share)
    for start, end in pairwise(places):
        shown = np.isfinite([start, end]).all() and np.abs(end - start).max() < image.shape[1] / 2
        if shown:
            _draw_line(image, np.array([start, end]), color, width)


def _draw_line(image: Image, ends_px: NDArray[Any], color: Rgb, width: int) -> None:
    (ua, va), (ub, vb) = np.clip(ends_px, -1e4, 1e4)
    cv2.line(image, (round(ua), round(va)), (round(ub), round(vb)), color, width, cv2.LINE_AA)


def draw_keypoints(image: Image, points: Sequence[sample.KeypointTruth], color: Rgb) -> None:
    """Draw bones and points inside the image, in place; hidden points are rings."""
    shown = {p.name: p for p in points if p.visibility}
    skeleton = skeletons.find_skeleton(p.name for p in points)
    for a, b in skeleton.bones:
        ends = [shown.get(skeleton.names[k]) for k in (a, b)]
        if ends[0] is not None and ends[1] is not None:
            cv2.line(image, _at(ends[0]), _at(ends[1]), color, 1, cv2.LINE_AA, _SHIFT)
    for point in shown.values():
        filled = cv2.FILLED if point.visibility == 2 else 1
        cv2.circle(image, _at(point), 2 << _SHIFT, color, filled, cv2.LINE_AA, _SHIFT)


def draw_tracks(image: Image, seen: Sequence[sample.SensorTracks], unit: float = 1.0) -> None:
    """Draw points and the ways they came, in place; points that are not visible are rings.

    Args:
        image: A photograph, uint8 [h, w, 3].
        seen: The points in earlier images of the sequence, and in this one.
        unit: As of ``draw_labels``.
    """
    now = seen[-1]
    places = [np.clip(np.nan_to_num(t.image_px, nan=-1e4) - 0.5, -1e4, 1e4) for t in seen]
    shown = now.state < sample.TRACK_STATES.index("outside")
    for k in np.flatnonzero(shown).tolist():
        color = id_color(k + 1)
        way = [p[k] for p, t in zip(places, seen, strict=True) if t.visible[k]]
        for start, end in pairwise(way):
            cv2.line(
                image, _fine(start), _fine(end), color, max(1, round(unit)), cv2.LINE_AA, _SHIFT
            )
        filled = cv2.FILLED if now.visible[k] else max(1, round(unit))
        radius = round(2.5 * max(1.0, unit) * (1 << _SHIFT))
        cv2.circle(image, _fine(places[-1][k]), radius, color, filled, cv2.LINE_AA, _SHIFT)


def _lighter(color: Rgb) -> Rgb:
    """Mix with white, to differ from the tint of the same object."""
    red, green, blue = color
    return ((red + 255) // 2, (green + 255) // 2, (blue + 255) // 2)


_SHIFT = 4
"""Fractional bits of OpenCV's drawing coordinates; its pixel centres are integers."""


def _at(point: sample.KeypointTruth) -> tuple[int, int]:
    u, v = point.image_px
    return _fine((u - 0.5, v - 0.5))


def _fine(place: Sequence[float] | NDArray[np.floating]) -> tuple[int, int]:
    """A place with OpenCV's pixel centres, in its fractional coordinates."""
    return (round(float(place[0]) * (1 << _SHIFT)), round(float(place[1]) * (1 << _SHIFT)))


def _in_front(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any] | None:
    """Clip a segment to the part in front of the camera, shape [2, 3]; None if there is none."""
    if a[2] < NEAR_M and b[2] < NEAR_M:
        return None
    if a[2] < NEAR_M:
        a = a + (b - a) * ((NEAR_M - a[2]) / (b[2] - a[2]))
    elif b[2] < NEAR_M:
        b = b + (a - b) * ((NEAR_M - b[2]) / (a[2] - b[2]))
    return np.stack([a, b])


def _surrounds(image: Image, item: sample.ObjectTruth) -> bool:
    """Whether a tint would colour the scene rather than an object in it."""
    fills = item.visible_px > SURROUNDING_SHARE * image.shape[0] * image.shape[1]
    return fills or item.instance.category in SURROUNDINGS


def _tint(image: Image, item: sample.ObjectTruth) -> None:
    if item.mask is None:
        return
    height, width = item.mask.pixels.shape
    window = image[item.mask.y_px :, item.mask.x_px :][:height, :width]
    color = np.array(id_color(item.instance.instance_id), np.float32)
    tinted = 0.65 * window[item.mask.pixels] + 0.35 * color
    window[item.mask.pixels] = tinted.astype(np.uint8)


def _outline(image: Image, item: sample.ObjectTruth, width: int) -> None:
    if item.mask is None:
        return
    # Zeros around it: pixels outside the mask's box are outside the mask.
    mask = np.pad(item.mask.pixels.astype(np.uint8), width)
    inner = cv2.erode(mask, np.ones((2 * width + 1, 2 * width + 1), np.uint8))
    edge = (mask > inner)[width:-width, width:-width]
    window = image[item.mask.y_px :, item.mask.x_px :][: edge.shape[0], : edge.shape[1]]
    window[edge] = id_color(item.instance.instance_id)


def title(item: sample.ObjectTruth) -> str:
    """The category of an object, with its d' where that is annotated."""
    index = "" if item.detectability is None else f" d'={item.detectability:.0f}"
    return f"{item.instance.category}{index}"


def _write(image: Image, item: sample.ObjectTruth, unit: float, places: list[boxes.BoxPx]) -> None:
    """Write the category of an object above its box, below the names at the same place."""
    assert item.box is not None
    text, size, pen = title(item), FONT_SIZE * unit, max(1, round(unit))
    (width, height), base = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, size, pen)
    pad = max(1, round(2 * unit))
    width, height = width + 2 * pad, height + base // 2 + 2 * pad
    x = min(max(item.box.x_min, 0), max(image.shape[1] - width, 0))
    y = max(item.box.y_min - height, 0)
    place = boxes.BoxPx(x, y, x + width, y + height)
    while (hidden := _overlapping(place, places)) and hidden.y_max + height <= image.shape[0]:
        place = boxes.BoxPx(x, hidden.y_max, x + width, hidden.y_max + height)
    places.append(place)
    plate = image[place.window()]
    plate[:] = plate // 4
    at = (x + pad, place.y_max - pad - base // 2)
    color = _lighter(id_color(item.instance.instance_id))
    cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, color, pen, cv2.LINE_AA)


def _overlapping(place: boxes.BoxPx, places: Sequence[boxes.BoxPx]) -> boxes.BoxPx | None:
    return next((other for other in places if not place.intersection(other).is_empty), None)
