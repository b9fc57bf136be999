"""Clips with control signals and captions, for world models and ControlNets.

::

    <split>/metadata.jsonl                  a line per frame: images and text
    <split>/000003/                         a clip: one view with all its steps
        rgb/000000.png                      the image
        depth/000000.png                    inverse depth, 8-bit grey: 255 = nearest, 0 = nothing
        segmentation/000000.png             a colour per instance, or per category; black = none
        edges/000000.png                    Canny edges of the image, 255
        caption.txt  clip.json              text; ranges, thresholds, rate
        rgb.mp4  depth.mp4  segmentation.mp4  edges.mp4     with ``video: true``
        cosmos_transfer.json                parameters of Cosmos-Transfer 2.5, with ``video: true``

Depth is ``(1 / z - 1 / far) / (1 / near - 1 / far)``, clipped to [0, 1]. The range is fixed by
``near_m`` and ``far_m``; without them, each image has its own, which ``clip.json`` states, as
estimators of relative depth have. Sequences need the fixed range, since depth would flicker.

``metadata.jsonl`` follows Hugging Face's ``imagefolder``: its columns are ``image``, ``depth``,
``segmentation``, ``edges`` and ``text``. diffusers' ``train_controlnet.py`` takes them by name.

A frame that is missing ends a clip; the next one is numbered behind all views.

Videos are MPEG-4, written by OpenCV: their bytes are the same in every run on a machine, but its
encoder chooses code by processor. The last row or column of an odd size is cut off.

References: the documentation of Cosmos-Transfer 2.5 and of Hugging Face datasets; Canny, "A
computational approach to edge detection", 1986; Ranftl et al., "Towards robust monocular depth
estimation", 2020 (normalised inverse depth).
"""

import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.core.capture import Channel
from gen_data.core.errors import ConfigError, StorageError
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample
from gen_data.core.serialization import canonical_json
from gen_data.exporters import base, captions, image_files, label_png, sensor_selection, sequences
from gen_data.exporters.conventions import ANY_LENS, Conventions
from gen_data.exporters.id_colors import id_colors
from gen_data.exporters.png import RowFilter, encode_png

CONTROLS = ("depth", "segmentation", "edges")
IMAGES = ("rgb", *CONTROLS)

COSMOS_NAMES = {"depth": "depth", "segmentation": "seg", "edges": "edge"}
"""Keys of the controls in the parameters of Cosmos-Transfer."""

Range = tuple[float, float]
"""Nearest and farthest depth [m]."""
NO_RANGE = (0.0, 0.0)
"""Range of an image of nothing."""


class ControlClips(base.ExporterBase):
    """Images of one camera with depth, segmentation, edges and captions.

    Attributes:
        camera: Sensor of the images; empty = the first one, by name, with the rgb channel.
        segmentation: A colour per ``instance`` or per ``category``.
        near_m: Depth that is white; needed for sequences, with ``far_m``.
        far_m: Depth that is black.
        canny_low: Gradient above which an edge continues.
        canny_high: Gradient above which an edge starts.
        video: Also write MP4 files, and parameters of Cosmos-Transfer.
        depth_weight: Weight of the depth control in the parameters.
        segmentation_weight: Weight of the segmentation control.
        edges_weight: Weight of the edge control.
    """

    type: Literal["control_clips"] = "control_clips"
    conventions: ClassVar[Conventions] = Conventions(lens=ANY_LENS)

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    camera: str = ""
    segmentation: Literal["instance", "category"] = "instance"
    near_m: float | None = Field(None, gt=0)
    far_m: float | None = Field(None, gt=0)
    canny_low: int = Field(100, ge=0)
    canny_high: int = Field(200, ge=0)
    video: bool = False
    depth_weight: float = Field(0.5, ge=0, le=1)
    segmentation_weight: float = Field(0.5, ge=0, le=1)
    edges_weight: float = Field(0.5, ge=0, le=1)

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent, or an invalid range.

        Raises:
            ConfigError: no such camera, it lacks a channel, the range of depth is missing or
                empty, or there are too many samples for six digits.
        """
        camera = sensor_selection.rgb_camera(info, self.camera, self.type)
        sensor_selection.require_channels(info, camera, (Channel.Z_DEPTH, self._ids), self.type)
        if (self.near_m is None) != (self.far_m is None) or not _increases(self._range()):
            raise ConfigError(
                f"exporter '{self.type}': near_m {self.near_m}, far_m {self.far_m}; expected both, "
                "with near_m < far_m, or neither"
            )
        if info.steps_per_scene > 1 and self.near_m is None:
            raise ConfigError(
                f"exporter '{self.type}': depth of a sequence needs a fixed range; "
                "set the nearest and farthest depth of your scenes, such as near_m: 0.5, far_m: 3 "
                "(table), near_m: 0.6, far_m: 10 (room) or near_m: 3, far_m: 100 (street)"
            )
        sequences.check_frame_names(info, self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the controls of each image, and a JSON line with its caption.

        Raises:
            ConfigError: see ``check``.
            StorageError: an image of the shard is missing.
        """
        self.check(info)
        camera = sensor_selection.rgb_camera(info, self.camera, self.type)
        folder = shard_dir / self.type
        rows = []
        for sample in samples:
            if camera not in sample.truth:
                continue
            read = {
                channel: image_files.read_pixels(
                    info.media_path(shard_dir, camera, channel, sample.index)
                )
                for channel in (Channel.RGB, Channel.Z_DEPTH, self._ids)
            }
            depth, (near_m, far_m) = self._depth(read[Channel.Z_DEPTH], info.depth_scale_m)
            edges = self._edges(read[Channel.RGB])
            files = {
                "depth": encode_png(depth, RowFilter.UP, 1),
                "segmentation": label_png.encode_label_png(read[self._ids], id_colors()),
                # Edges are mostly borders, which the encoder of labels is slow for.
                "edges": encode_png(edges, RowFilter.UP, 1),
            }
            for kind, png in files.items():
                sequences.write_bytes(folder / kind / f"{sample.index:09d}.png", png)
            row = {
                **sequences.frame_facts(info, sample),
                "text": captions.caption(sample, camera),
                "near_m": near_m,
                "far_m": far_m,
                "size": [depth.shape[1], depth.shape[0]],
            }
            rows.append(row)
        sequences.write_frames(folder, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link the images of every clip, describe it, and list all frames."""
        camera = sensor_selection.rgb_camera(info, self.camera, self.type)
        dataset_dir.mkdir(parents=True, exist_ok=True)
        for number, frames in sequences.even_sequences(info, shard_dirs, self.type).items():
            split = dataset_dir / frames[0].row["split"]
            folder = split / f"{number:06d}"
            for k, frame in enumerate(frames):
                for kind in IMAGES:
                    source = self._source(info, frame, kind, camera)
                    image_files.link_or_copy(source, folder / kind / f"{k:06d}{source.suffix}")
            with (split / "metadata.jsonl").open("a", encoding="utf-8", newline="\n") as file:
                suffix = info.encoding(camera, Channel.RGB).suffix
                file.writelines(_metadata_lines(folder.name, frames, suffix))
            self._describe(info, camera, folder, frames)

    @property
    def _ids(self) -> Channel:
        return Channel.INSTANCE if self.segmentation == "instance" else Channel.CATEGORY

    def _range(self) -> Range | None:
        return None if self.near_m is None or self.far_m is None else (self.near_m, self.far_m)

    def _depth(self, units: NDArray[np.uint16], scale_m: float) -> tuple[NDArray[np.uint8], Range]:
        """Inverse depth of an image of depth units, and its range; see ``inverse_depth``."""
        # Fewer depths than pixels are possible: an image is a look-up of its units.
        present = np.flatnonzero(np.bincount(units.ravel()))
        values, span_m = inverse_depth(image_files.depths_of_units(scale_m)[present], self._range())
        table = np.zeros(image_files.DEPTH_UNITS_MAX + 1, np.uint8)
        table[present] = values
        return table[units], span_m

    def _edges(self, rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
        grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
        return np.asarray(cv2.Canny(grey, self.canny_low, self.canny_high), np.uint8)

    def _source(self, info: DatasetInfo, frame: sequences.Frame, kind: str, camera: str) -> Path:
        if kind == "rgb":
            return info.media_path(frame.shard_dir, camera, Channel.RGB, frame.index)
        return frame.shard_dir / self.type / kind / f"{frame.index:09d}.png"

    def _describe(
        self, info: DatasetInfo, camera: str, folder: Path, frames: Sequence[sequences.Frame]
    ) -> None:
        text = frames[0].row["text"]
        rate_hz = sequences.frame_rate_hz(info, frames)
        sequences.write_text(folder / "caption.txt", f"{text}\n")
        facts = {
            "caption": text,
            "camera": camera,
            "samples": [frame.index for frame in frames],
            "rate_hz": rate_hz,
            "size_px": frames[0].row["size"],
            "depth": {
                "encoding": "(1 / z - 1 / far) / (1 / near - 1 / far)",
                "near_m": [frame.row["near_m"] for frame in frames],
                "far_m": [frame.row["far_m"] for frame in frames],
            },
            "segmentation": self.segmentation,
            "edges": {"canny_low": self.canny_low, "canny_high": self.canny_high},
        }
        sequences.write_json(folder / "clip.json", facts)
        if self.video:
            for kind in IMAGES:
                suffix = info.encoding(camera, Channel.RGB).suffix if kind == "rgb" else ".png"
                images = [folder / kind / f"{k:06d}{suffix}" for k in range(len(frames))]
                write_video(folder / f"{kind}.mp4", images, rate_hz)
            parameters = self._cosmos_parameters(f"{info.name}_{folder.name}", text)
            text = json.dumps(parameters, indent=2, ensure_ascii=False)
            sequences.write_text(folder / "cosmos_transfer.json", text + "\n")

    def _cosmos_parameters(self, name: str, prompt: str) -> dict[str, Any]:
        """Parameters of Cosmos-Transfer 2.5; paths are relative to the clip."""
        weights = {
            "depth": self.depth_weight,
            "segmentation": self.segmentation_weight,
            "edges": self.edges_weight,
        }
        controls = {
            COSMOS_NAMES[kind]: {"control_path": f"{kind}.mp4", "control_weight": weights[kind]}
            for kind in CONTROLS
        }
        return {"name": name, "prompt": prompt, "video_path": "rgb.mp4", **controls}


def inverse_depth(
    depth_m: NDArray[np.float32], span_m: Range | None
) -> tuple[NDArray[np.uint8], Range]:
    """Normalise inverse depth to 255 = nearest, 0 = farthest or nothing.

    Args:
        depth_m: z-depth, of any shape; inf = nothing.
        span_m: Depths of white and black; None = nearest and farthest of the image.

    Returns:
        The image, uint8 of that shape, and its range [m]; (0, 0) for an image of nothing.
    """
    known = np.isfinite(depth_m)
    if span_m is None:
        if not known.any():
            return np.zeros(depth_m.shape, np.uint8), NO_RANGE
        seen = depth_m[known]
        span_m = (round(float(seen.min()), 6), round(float(seen.max()), 6))
    near_m, far_m = span_m
    # A flat image is white: every point of it is the nearest.
    width = 1.0 / near_m - 1.0 / far_m if near_m < far_m else 1.0 / near_m
    offset = 1.0 / far_m if near_m < far_m else 0.0
    share = (1.0 / np.where(known, depth_m, np.inf).astype(np.float64) - offset) / width
    return np.rint(255.0 * np.clip(share, 0.0, 1.0)).astype(np.uint8), span_m


def write_video(path: Path, images: Sequence[Path], rate_hz: float) -> None:
    """Write images of equal size as an MPEG-4 video.

    Raises:
        StorageError: OpenCV cannot write it, or an image is missing.
    """
    writer = None
    for image in images:
        pixels = cv2.imread(str(image), cv2.IMREAD_COLOR)
        if pixels is None:
            raise StorageError(f"{image}: missing or no PNG file; generate the data set again")
        if writer is None:
            code = cv2.VideoWriter.fourcc(*"mp4v")
            writer = cv2.VideoWriter(str(path), code, rate_hz, pixels.shape[1::-1])
            if not writer.isOpened():
                raise StorageError(f"{path}: OpenCV has no encoder for MP4; set video: false")
        writer.write(pixels)
    if writer is not None:
        writer.release()


def _metadata_lines(clip: str, frames: Sequence[sequences.Frame], suffix: str) -> Iterator[str]:
    """Lines of ``metadata.jsonl``: names of images relative to it, and the caption."""
    for k, frame in enumerate(frames):
        files = {f"{kind}_file_name": f"{clip}/{kind}/{k:06d}.png" for kind in CONTROLS}
        row = {
            # Next to other columns of images, a plain ``file_name`` becomes the first of them.
            "image_file_name": f"{clip}/rgb/{k:06d}{suffix}",
            **files,
            "text": frame.row["text"],
            "clip": clip,
            "frame": k,
        }
        yield canonical_json(row) + "\n"


def _increases(span_m: Range | None) -> bool:
    return span_m is None or span_m[0] < span_m[1]
