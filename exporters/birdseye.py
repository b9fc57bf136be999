"""Bird's-eye views around the ego vehicle: layers as images, lanes and boxes as JSON.

::

    <layer>/000000012.png    8-bit grey, 255 where the layer is: drivable, parking, crosswalk,
                             sidewalk, lane_divider, road_divider, vehicles, people, free_space
    frames.jsonl             one line per sample
    lanes/<camera>.jsonl     one line per image, in TuSimple's form

The ego is in the middle of every image and faces up: the centre of pixel (row r, column c) of n x n
is at ``x = (n / 2 - r - 0.5) px_m`` ahead and ``y = (n / 2 - c - 0.5) px_m`` to the left, in the
frame ``T_world_map``, which is level and has its origin at the ego's rig.

A line of ``frames.jsonl``: ``index``, ``scene``, ``view``, ``step``, ``time_s``, ``split``;
``px_m``, ``size_px``, ``T_world_map``; ``ego``: ``T_world_ego`` and, world axes, its
``velocity_m_s``, ``acceleration_m_s2``, ``angular_velocity_rad_s``; ``borders``: of lanes near the
map, each with ``name``, ``kind`` (``lane``, ``road``, ``edge``) and ``points_m`` in the map's
frame; ``boxes3d``: by frame, ``ego`` and each laser scanner's, ``instance_id``, ``category``,
``center_m``, full ``size_m`` and ``quaternion_wxyz``. Track ids are instance ids, and hold for a
scene.

A line of ``lanes/<camera>.jsonl``: ``raw_file``, ``h_samples`` (image rows) and ``lanes``: per line
the columns at those rows, -2 for none, as in TuSimple's benchmark (its pixel centres are integers:
0.5 less than ours); and ``borders``, the exact points, with ``visible``.

References: the map expansion of nuScenes (Caesar et al., CVPR 2020); Philion and Fidler, "Lift,
Splat, Shoot", ECCV 2020; TuSimple lane detection benchmark, 2017.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np

from gen_data.core import capture, lane_geometry, motion
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import BirdseyeMap, EgoTruth, Sample
from gen_data.core.serialization import canonical_json
from gen_data.exporters import base, image_files, png, sequences
from gen_data.exporters.conventions import ANY_LENS, SAMPLE, Conventions
from gen_data.exporters.lane_lines import columns_at

FRAMES, LANES = "frames.jsonl", "lanes"
ROWS_PX = 10
"""Spacing of the image rows at which TuSimple lists columns."""
MARGIN = 1.2
"""Borders are listed up to this multiple of the map's reach."""
DECIMALS = 4


class Birdseye(base.ExporterBase):
    """Bird's-eye layers, lanes and boxes around the ego, for map and BEV perception."""

    type: Literal["birdseye"] = "birdseye"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i in `lanes`, i + 0.5 in `borders`", lens=ANY_LENS, time=SAMPLE
    )
    annotators: ClassVar[frozenset[str]] = frozenset({"bev_map", "boxes3d", "lanes"})

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT

    def check(self, info: DatasetInfo) -> None:
        """Accept any data set; the annotator ``bev_map`` rejects scenes without a rig."""

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the layers of each sample, a line for it, and a line for each of its images."""
        folder = shard_dir / self.type
        frames: list[str] = []
        images: dict[str, list[str]] = {sensor: [] for sensor in info.cameras}
        for sample in samples:
            truth = sample.frame
            assert truth is not None, "bev_map is in `needs`"
            assert truth.birdseye is not None, "bev_map is in `needs`"
            for name, mask in truth.birdseye.layers.items():
                path = folder / "layers" / name / f"{sample.index:09d}.png"
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(png.encode_png(mask * np.uint8(255), png.RowFilter.UP, 2))
            frames.append(canonical_json(_frame(sample, truth, truth.birdseye)) + "\n")
            for sensor in (s for s in info.cameras if s in sample.truth):
                images[sensor].append(canonical_json(_image(info, sample, sensor)) + "\n")
        sequences.write_text(folder / FRAMES, "".join(frames))
        for sensor, lines in images.items():
            sequences.write_text(folder / LANES / f"{sensor}.jsonl", "".join(lines))

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link the layers of all shards, given in index order, and join their lines."""
        folders = [shard_dir / self.type for shard_dir in shard_dirs]
        for folder in folders:
            for layer in sorted((folder / "layers").iterdir()):
                for path in sorted(layer.iterdir()):
                    image_files.link_or_copy(path, dataset_dir / layer.name / path.name)
        for name in (FRAMES, *(f"{LANES}/{sensor}.jsonl" for sensor in info.cameras)):
            lines = "".join((folder / name).read_text("utf-8") for folder in folders)
            sequences.write_text(dataset_dir / name, lines)


def _frame(sample: Sample, truth: EgoTruth, birdseye: BirdseyeMap) -> dict[str, Any]:
    size_px = len(next(iter(birdseye.layers.values())))
    return {
        "index": sample.index,
        "scene": sample.scene_index,
        "view": sample.view_index,
        "step": sample.step_index,
        "time_s": sample.scene.time_s,
        "split": sample.split,
        "px_m": birdseye.px_m,
        "size_px": size_px,
        "T_world_map": birdseye.T_world_map.matrix().tolist(),
        "ego": {
            "T_world_ego": truth.T_world_ego.matrix().tolist(),
            **{f.name: getattr(truth.twist, f.name) for f in fields(motion.Twist)},
        },
        "borders": list(_borders(truth.borders or (), birdseye, 0.5 * size_px * birdseye.px_m)),
        "boxes3d": _boxes(sample, truth),
    }


def _borders(
    borders: Iterable[lane_geometry.LaneBorder], birdseye: BirdseyeMap, reach_m: float
) -> Iterator[dict[str, Any]]:
    """Sections of borders on or near the map, in its frame."""
    T_map_world = birdseye.T_world_map.inverse()
    for border in borders:
        line = T_map_world.apply(np.asarray(border.points_m))
        near = (np.abs(line[:, :2]) < MARGIN * reach_m).all(axis=1)
        edges = np.flatnonzero(np.diff(near, prepend=False, append=False))
        for start, end in zip(edges[::2], edges[1::2], strict=True):
            points = (np.round(line[start:end], DECIMALS) + 0.0).tolist()
            yield {"name": border.name, "kind": border.kind, "points_m": points}


def _boxes(sample: Sample, truth: EgoTruth) -> dict[str, list[dict[str, Any]]]:
    categories = {i.instance_id: i.category for i in sample.scene.instances if i.annotated}
    return {
        frame: [
            {
                "instance_id": number,
                "category": categories[number],
                "center_m": [round(v, DECIMALS) + 0.0 for v in box.T_frame_box.translation_m],
                "size_m": box.size_m,
                "quaternion_wxyz": [round(v, 8) + 0.0 for v in box.T_frame_box.quaternion_wxyz],
            }
            for number, box in boxes.items()
            if number in categories
        ]
        for frame, boxes in (truth.boxes3d or {}).items()
    }


def _image(info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
    truth = sample.truth[sensor]
    suffix = info.encoding(sensor, capture.Channel.RGB).suffix
    rows = list(range(0, truth.camera.intrinsics.height_px, ROWS_PX))
    borders = truth.borders or ()
    return {
        "index": sample.index,
        "raw_file": f"{sensor}/{capture.Channel.RGB.value}/{sample.index:09d}{suffix}",
        "h_samples": rows,
        "lanes": [columns_at(np.array(border.points_px), rows) for border in borders],
        "borders": [
            {
                "name": border.border,
                "kind": border.kind,
                "points_px": border.points_px,
                "visible": [int(seen) for seen in border.visible],
            }
            for border in borders
        ],
    }
