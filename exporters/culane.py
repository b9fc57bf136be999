"""CULane: up to four lines of lanes per photograph, as points at fixed rows.

::

    <split>/<segment>/000000012.png                    links to the photographs (PNG, or JPEG)
    <split>/<segment>/000000012.lines.txt              a line of text per line of a lane
    laneseg_label_w16/<split>/<segment>/000000012.png  8-bit grey: 1 to 4 on 16 px wide lines
    list/<split>.txt                                   photographs of a split
    list/<split>_gt.txt                                the same with mask and existence

A segment is a sequence of one camera. The lines are the two nearest ones on each side of the
camera that are painted, from left to right; ``edges: true`` adds edges of the carriageway without
paint. A line of text has ``x y`` at every tenth row, from the bottom up; pixel centres are whole
numbers. Lines go on behind objects that hide them, as annotators draw them, unless all of their
points are hidden. In ``_gt.txt`` four numbers tell which of left-left, left, right and right-right
exist; these are also the values of the mask.

Reference: Pan et al., "Spatial As Deep: Spatial CNN for Traffic Scene Understanding", AAAI 2018,
and the layout of CULane.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import ClassVar, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample
from gen_data.exporters import base, fragments, image_files, sequences
from gen_data.exporters.conventions import ANY_LENS, Conventions
from gen_data.exporters.lane_lines import (
    ABSENT,
    SIDES,
    LaneLine,
    PaintedWorlds,
    columns_at,
    lane_lines,
)
from gen_data.exporters.png import RowFilter, encode_png
from gen_data.exporters.road_map import StreetExporter
from gen_data.exporters.sensor_selection import check_channels, photographs

MASKS = "laneseg_label_w16"
ROWS_PX, WIDTH_PX = 10, 16
"""Distance of the rows; width of the lines of masks."""


class CULane(StreetExporter):
    """CULane: the four lines of lanes next to the camera, as points and as masks."""

    type: Literal["culane"] = "culane"
    conventions: ClassVar[Conventions] = Conventions(pixel_centre="i", lens=ANY_LENS)
    annotators: ClassVar[frozenset[str]] = frozenset({"lanes"})
    own_classes: ClassVar[bool] = True
    image_formats: ClassVar[frozenset[str]] = base.PNG_OR_JPEG
    edges: bool = False
    """Whether edges of the carriageway without paint count as lines."""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: no sensor writes the rgb channel, or Shapely is missing.
        """
        check_channels(info, (), self.type)
        super().check(info)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write text and mask of each photograph."""
        self.check(info)
        rows, worlds = [], PaintedWorlds(self.library)
        for sample, sensor in photographs(info, samples):
            found = lane_lines(sample, sensor, worlds.dividers(sample, sensor), edges=self.edges)
            size = sample.truth[sensor].camera.intrinsics
            points = {line.side: row_points(line, size.height_px) for line in found if line.side}
            lines = {side: places for side, places in points.items() if places}
            segment = f"segment-{sequences.sequence_number(info, sample.index):06d}_{sensor}"
            name, folder = f"{sample.split}/{segment}/{sample.index:09d}", shard_dir / self.type
            texts = [" ".join(f"{x:g} {y}" for x, y in lines[side]) for side in sorted(lines)]
            sequences.write_text(
                folder / f"{name}.lines.txt", "".join(f"{text}\n" for text in texts)
            )
            mask = line_mask(lines, (size.height_px, size.width_px))
            sequences.write_bytes(folder / MASKS / f"{name}.png", encode_png(mask, RowFilter.UP, 2))
            rows.append(
                {
                    "sample": sample.index,
                    "sensor": sensor,
                    "name": name,
                    "suffix": info.encoding(sensor, Channel.RGB).suffix,
                    "exists": [int(side in lines) for side in SIDES],
                }
            )
        sequences.write_frames(shard_dir / self.type, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Link images, texts and masks, and list them."""
        lists: dict[str, list[str]] = {}
        for shard_dir, row in fragments.fragment_rows(shard_dirs, self.type, sequences.FRAMES):
            name, folder = row["name"], shard_dir / self.type
            image, mask = f"{name}{row['suffix']}", f"{MASKS}/{name}.png"
            image_files.link_photograph(info, shard_dir, row, dataset_dir / image)
            for file in (f"{name}.lines.txt", mask):
                image_files.link_or_copy(folder / file, dataset_dir / file)
            split, exists = name.partition("/")[0], " ".join(map(str, row["exists"]))
            lists.setdefault(split, []).append(f"/{image}\n")
            lists.setdefault(f"{split}_gt", []).append(f"/{image} /{mask} {exists}\n")
        for name, lines in lists.items():
            sequences.write_text(dataset_dir / f"list/{name}.txt", "".join(lines))


def row_points(line: LaneLine, height_px: int) -> list[tuple[float, int]]:
    """Points at fixed rows, from the bottom up; empty for a line of which nothing is visible."""
    if not line.visible.any():
        return []
    rows = list(range((height_px - 1) // ROWS_PX * ROWS_PX, -1, -ROWS_PX))
    columns = columns_at(line.points_px, rows)
    points = [(x, y) for x, y in zip(columns, rows, strict=True) if x != ABSENT]
    return points if len(points) > 1 else []


def line_mask(
    lines: dict[int, list[tuple[float, int]]], shape: tuple[int, int]
) -> NDArray[np.uint8]:
    """Mask [height, width] of lines by their side."""
    mask = np.zeros(shape, np.uint8)
    for value, side in enumerate(SIDES, 1):
        if side in lines:
            points = np.rint(lines[side]).astype(np.int32)
            cv2.polylines(mask, [points], isClosed=False, color=value, thickness=WIDTH_PX)
    return mask
