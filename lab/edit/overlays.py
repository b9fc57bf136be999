"""Pictures of a sample: its photograph with labels, depth, normals, layers, a scan from above."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from gen_data.core import plugins
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.interfaces import Modality, SensorInfo
from gen_data.core.sample import Sample
from gen_data.preview.depth_scale import draw_depth_scale
from gen_data.preview.lane_view import draw_borders
from gen_data.preview.overlay import Image, channel_image, draw_labels
from gen_data.preview.sensor_views import top_view
from gen_data.preview.text_view import draw_texts
from gen_data.runner.stored import LabelledImages

LAYERS: Mapping[str, str] = {
    "boxes": "boxes2d",
    "masks": "instance_masks",
    "keypoints": "keypoints",
    "boxes3d": "boxes3d",
    "names": "boxes2d",
    "lanes": "lanes",
    "text": "text",
}
"""Annotation that each kind of label on a photograph needs."""

KINDS: Mapping[str, tuple[Channel, ...]] = {
    "photo": (Channel.RGB,),
    "depth": (Channel.Z_DEPTH, Channel.RANGE),
    "normals": (Channel.NORMALS,),
    "layers": (Channel.INSTANCE_LAYERS,),
    "mirrors": (Channel.SEEN_IN_MIRROR,),
    "scan": (),
    "device": (),
}
"""Pictures of a sample, and the channels of cameras that they need; layers are side by side."""

_MODALITIES = {Modality.CAMERA: "photo", Modality.LIDAR: "scan", Modality.DEVICE: "device"}


@dataclass(frozen=True, slots=True)
class View:
    """Content of a picture.

    Attributes:
        kind: One of ``KINDS``.
        sensor: Name; empty = the first that has such a picture.
        layers: Labels that are drawn on a photograph.
    """

    kind: str = "photo"
    sensor: str = ""
    layers: frozenset[str] = frozenset({"boxes"})

    @property
    def modality(self) -> str:
        """Kind of the picture that a sensor of this view has anyway."""
        return "photo" if KINDS[self.kind] else self.kind

    def of(self, sensor: str) -> "View":
        """The same view, of a given sensor."""
        return replace(self, sensor=sensor)


def first_kind(sensor: SensorInfo) -> str:
    """Kind of the picture that every reading of a sensor has; empty = none, as for odometers."""
    has_none = sensor.modality is Modality.DEVICE and not sensor.view
    return "" if has_none else _MODALITIES[sensor.modality]


def find_empty(sample: Sample | LabelledImages, view: View) -> frozenset[str]:
    """Layers of a view, or its kind, for which the sample has no data."""
    reading = sample.capture.readings.get(view.sensor)
    if reading is None:
        cloud = sample.capture.clouds.get(view.sensor)
        return frozenset({"scan"} if cloud is not None and not len(cloud.points) else ())
    if view.kind == "photo":
        return frozenset(layer for layer in view.layers if not _has(sample, view.sensor, layer))
    channel = _channel(reading, view.kind)
    if view.kind == "mirrors":
        is_empty = channel is None or not reading.channels[channel].any()
    elif view.kind == "layers":  # The first layer is the picture itself.
        is_empty = channel is None or not reading.channels[channel][..., 1:].any()
    else:
        is_empty = channel is None
    return frozenset({view.kind} if is_empty else ())


def _channel(reading: SensorReading, kind: str) -> Channel | None:
    """The channel of a reading that a kind of picture shows; None if it has none of them."""
    return next((c for c in KINDS[kind] if c in reading.channels), None)


def _has(sample: Sample | LabelledImages, sensor: str, layer: str) -> bool:
    truth = sample.truth[sensor]
    if layer in ("lanes", "text"):
        return bool(truth.borders if layer == "lanes" else truth.texts)
    part = {
        "boxes": "box",
        "names": "box",
        "masks": "mask",
        "keypoints": "keypoints",
        "boxes3d": "box3d_camera",
    }
    return any(getattr(item, part[layer]) for item in truth.objects)


def draw_view(
    sample: Sample | LabelledImages, view: View, views: Mapping[str, str], unit: float
) -> Image:
    """Draw a view, uint8 [h, w, 3].

    Args:
        sample: With a reading of the view's sensor.
        view: Its sensor has a name.
        views: ``module:function`` that draws the readings of a device, by its name.
        unit: Width of lines [px].
    """
    name = view.sensor
    if name in sample.capture.clouds:
        return top_view(sample.capture.clouds[name], sample.scene, 1.0)
    if name in sample.capture.tables:
        draw = plugins.loaded(views[name], f"view of '{name}'")
        image: Image = draw(sample.capture.tables[name], sample.scene, 1.0)
        return image
    reading = sample.capture.readings[name]
    if view.kind == "photo" and Channel.RGB in reading.channels:
        image = draw_labels(reading, sample.truth[name], unit, view.layers)
        if "lanes" in view.layers:
            draw_borders(image, sample.truth[name].borders or (), unit)
        if "text" in view.layers:
            draw_texts(image, sample.truth[name].texts or (), unit)
        return image
    shown = _channel(reading, view.kind)
    image = channel_image(reading, shown or next(iter(reading.channels)))
    if view.kind == "depth" and shown is not None:
        draw_depth_scale(image, reading.channels[shown], max(1.0, unit))
    return image
