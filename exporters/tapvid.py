"""Point tracks as TAP-Vid and TAPVid-3D have them: one file per sequence and camera.

::

    tapvid/<split>/000003_color.pkl      layout ``tapvid``, as the DAVIS and RoboTAP files
    tapvid3d/<split>/000003_color.npz    layout ``tapvid3d``

* **tapvid**: a pickled ``{"000003_color": {"video", "points", "occluded"}}``: uint8 [frames,
  height, width, 3]; float32 [points, frames, 2], x and y in shares of width and height from the
  corner of the image; bool [points, frames].
* **tapvid3d**: ``tracks_XYZ`` float32 [frames, points, 3], camera frame [m]; ``visibility`` bool
  [frames, points]; ``fx_fy_cx_cy``; ``queries_xyt`` float32 [points, 3], pixel and frame where a
  point is first visible; ``images_jpeg_bytes`` [frames]; ``extrinsics_w2c`` [frames, 4, 4].

A point that is never visible in a camera is in none of its files. Positions beyond the image are
outside of [0, 1]; where the lens has no image of a point it is at (0, 0), and occluded.

Reference: Doersch et al., "TAP-Vid", NeurIPS 2022; Koppula et al., "TAPVid-3D", NeurIPS 2024; and
the readers in google-deepmind/tapnet.
"""

import pickle
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gen_data.core.capture import Channel, ImageEncoding
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.reported import reported
from gen_data.core.sample import TRACK_STATES, Sample, SensorTracks
from gen_data.core.scene import Camera
from gen_data.exporters import base, image_files, sensor_selection
from gen_data.exporters.conventions import ANY_LENS, Conventions
from gen_data.exporters.npz import npz_bytes
from gen_data.exporters.sequences import (
    Frame,
    frame_facts,
    read_sequences,
    unbroken_episodes,
    write_bytes,
    write_frames,
)

Layout = Literal["tapvid", "tapvid3d"]
LEVEL = 1
"""Of compression; higher ones save little."""
PICKLE = 4
VISIBLE, GLASS = TRACK_STATES.index("visible"), TRACK_STATES.index("glass")


@dataclass(frozen=True, eq=False, slots=True)
class _Clip:
    """A sequence of one camera: its name, frames, and arrays of its tracks, frames first."""

    info: DatasetInfo
    camera: str
    name: str
    frames: Sequence[Frame]
    tracks: dict[str, NDArray[Any]]

    def path(self, frame: Frame) -> Path:
        return self.info.media_path(frame.shard_dir, self.camera, Channel.RGB, frame.index)

    def photograph(self, frame: Frame) -> NDArray[np.uint8]:
        return image_files.read_image(self.path(frame), Channel.RGB, self.info.depth_scale_m)


class TapVid(base.ExporterBase):
    """Videos with point tracks for TAP-Vid and TAPVid-3D.

    Attributes:
        layouts: Layouts to write; ``tapvid3d`` describes pinholes only.
        through_glass: Whether points behind panes of glass count as visible, as photographs show
            them.
        jpeg_quality: Quality of the images of ``tapvid3d``, unless the camera writes JPEG itself.
    """

    type: Literal["tapvid"] = "tapvid"
    conventions: ClassVar[Conventions] = Conventions(pixel_centre="i + 0.5", lens=ANY_LENS)
    annotators: ClassVar[frozenset[str]] = frozenset({"tracks"})
    own_classes: ClassVar[bool] = True
    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    layouts: tuple[Layout, ...] = Field(("tapvid", "tapvid3d"), min_length=1)
    through_glass: bool = True
    jpeg_quality: int = Field(95, ge=1, le=100)

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set without photographs, or with lenses that a layout cannot describe.

        Raises:
            ConfigError: the text names the camera.
        """
        sensor_selection.rgb_camera(info, "", self.type)
        if "tapvid3d" in self.layouts:
            cameras = sensor_selection.rgb_cameras(info)
            sensor_selection.check_pinholes(info, cameras, self.type, "layouts: 'tapvid3d'")

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the tracks of each image, and a line for each sample."""
        self.check(info)
        folder = shard_dir / self.type
        rows = []
        for sample in samples:
            assert sample.frame is not None, "tracks is in `needs`"
            tracks = sample.frame.tracks
            assert tracks is not None, "tracks is in `needs`"
            cameras = [n for n in sensor_selection.rgb_cameras(info) if n in sample.truth]
            for name in cameras:
                arrays = self._arrays(tracks.sensors[name], sample.truth[name].camera)
                write_bytes(_fragment(folder, name, sample.index), npz_bytes(arrays, LEVEL))
            rows.append(frame_facts(info, sample) | {"cameras": cameras})
        write_frames(folder, rows)

    def _arrays(self, tracks: SensorTracks, camera: Camera) -> dict[str, NDArray[Any]]:
        k = camera.intrinsics
        seen = tracks.state == VISIBLE
        if self.through_glass:
            seen |= tracks.state == GLASS
        return {
            "position_m": tracks.position_m,
            "image_px": np.nan_to_num(tracks.image_px, nan=0.0),
            "visible": seen,
            "K": np.array([k.fx_px, k.fy_px, k.cx_px, k.cy_px]),
            "T_camera_world": reported(camera).T_world_camera.inverse().matrix(),
        }

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write a file for every sequence and camera; a frame that is missing ends a sequence."""
        dataset_dir.mkdir(parents=True, exist_ok=True)
        makers: dict[Layout, tuple[str, Callable[[_Clip], bytes]]] = {
            "tapvid": ("pkl", self._video),
            "tapvid3d": ("npz", self._scene_tracks),
        }
        for camera in sensor_selection.rgb_cameras(info):
            for name, frames in _videos(shard_dirs, self.type, camera):
                arrays = [
                    dict(np.load(_fragment(f.shard_dir / self.type, camera, f.index)))
                    for f in frames
                ]
                stacked = {key: np.stack([a[key] for a in arrays]) for key in arrays[0]}
                kept = stacked["visible"].any(axis=0)
                if not kept.any():
                    continue
                for key in ("position_m", "image_px", "visible"):
                    stacked[key] = stacked[key][:, kept]
                for layout in self.layouts:
                    ending, make = makers[layout]
                    path = dataset_dir / layout / frames[0].row["split"] / f"{name}.{ending}"
                    write_bytes(path, make(_Clip(info, camera, name, frames, stacked)))

    def _video(self, clip: _Clip) -> bytes:
        images = np.stack([clip.photograph(frame) for frame in clip.frames])
        points = clip.tracks["image_px"].transpose(1, 0, 2) / images.shape[2:0:-1]
        arrays = {
            "video": images,
            "points": points.astype(np.float32),
            "occluded": ~clip.tracks["visible"].T,
        }
        return pickled({clip.name: arrays})

    def _scene_tracks(self, clip: _Clip) -> bytes:
        tracks = clip.tracks
        first = tracks["visible"].argmax(axis=0)
        places_px = tracks["image_px"][first, np.arange(len(first))]
        arrays = {
            "tracks_XYZ": tracks["position_m"],
            "visibility": tracks["visible"],
            "fx_fy_cx_cy": tracks["K"][0],
            "queries_xyt": np.column_stack([places_px, first]).astype(np.float32),
            # Fixed lengths, which need no pickle: zeros at the end are dropped, JPEG ends with D9.
            "images_jpeg_bytes": np.array([self._jpeg(clip, frame) for frame in clip.frames]),
            "extrinsics_w2c": tracks["T_camera_world"],
        }
        return npz_bytes(arrays, LEVEL)

    def _jpeg(self, clip: _Clip, frame: Frame) -> bytes:
        if clip.info.encoding(clip.camera, Channel.RGB).format == "jpeg":
            return clip.path(frame).read_bytes()
        image, encoding = clip.photograph(frame), ImageEncoding("jpeg", self.jpeg_quality)
        return image_files.encode_channel(Channel.RGB, image, clip.info.depth_scale_m, encoding)


class _Arrays(pickle.Pickler):
    """Pickles arrays by their public constructor: every release of NumPy reads and writes it."""

    def reducer_override(self, value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return np.ndarray, (value.shape, value.dtype.str, value.tobytes())
        return NotImplemented


def pickled(value: Any) -> bytes:
    """Pickle dictionaries of arrays, which are read-only when loaded."""
    file = BytesIO()
    _Arrays(file, PICKLE).dump(value)
    return file.getvalue()


def _videos(
    shard_dirs: Sequence[Path], exporter: str, camera: str
) -> Iterator[tuple[str, list[Frame]]]:
    """Name and frames of every video of a camera, at even distances."""
    sequences = read_sequences(shard_dirs, exporter)
    own = {k: [f for f in v if camera in f.row["cameras"]] for k, v in sequences.items()}
    gaps = (b.index - a.index for frames in own.values() for a, b in pairwise(frames))
    steps = min(gaps, default=1)
    for number, frames in own.items():
        for part, video in enumerate(unbroken_episodes(frames, steps)):
            yield f"{number:06d}_{camera}" + (f"_part{part}" if part else ""), video


def _fragment(folder: Path, camera: str, index: int) -> Path:
    return folder / f"{index:09d}.{camera}.npz"
