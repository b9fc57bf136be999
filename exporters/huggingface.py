"""Hugging Face data sets: Parquet files with embedded images, and a dataset card.

::

    README.md                               card: splits, features, licence, meaning of the columns
    data/train-00000-of-00002.parquet       one row per image of every camera

Columns: ``image`` (rgb) and the camera's other channels under their names, ``image_id``, ``width``,
``height``, ``sample``, ``scene``, ``view``, ``step``, ``time_s``, ``sensor``, ``K`` (3 x 3, row by
row), ``T_world_camera`` (4 x 4) and ``objects``, a struct of lists. Data sets with a camera that is
no pinhole have a column ``lens``, a struct: ``model``, ``distortion`` (coefficients in the order of
OpenCV's functions, to be applied before ``K``) and ``half_field_rad``, the angle to the axis at
which its image ends; null for a pinhole. Objects are:

``id``, ``instance_id``, ``category`` (ClassLabel, from 0), ``bbox`` (x, y, width, height [px]),
``area`` (visible pixels), ``iscrowd``, ``rle`` (COCO's compressed runs of the visible mask; its
size is height x width), ``visible_fraction``, ``occlusion``, ``truncation``, and ``box3d``
(camera frame: centre [m], full size [m], quaternion w x y z). Annotations that are disabled are
null. Ignored objects are left out, and ``iscrowd`` is false: scripts that train on such data sets,
as of transformers, take every object for one to learn.

Images keep the bytes of the shards' files: photographs may be JPEG or WebP. Channels of three
16-bit components (flow, object coordinates) are binary columns of PNG files, since Pillow would
reduce them to 8 bits. An image that a camera does not write is null.

Ids, pixels and box values equal the ones of the exporter ``coco``. Bytes of Parquet files depend on
the release of pyarrow, which writes its name into them; plans name that release.

References: https://huggingface.co/docs/hub/datasets-cards;
https://huggingface.co/docs/datasets/about_dataset_features; ``datasets`` reads the features from
the key ``huggingface`` of the Parquet schema.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import yaml
from pydantic import Field

from gen_data.core import boxes, capture
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.lens import Lens
from gen_data.core.reported import reported
from gen_data.core.sample import ObjectTruth, Sample
from gen_data.exporters import base, fragments, rle, sequences
from gen_data.exporters.conventions import EDGES, READING, Conventions
from gen_data.exporters.lens_fields import has_bent_camera, lens_fields
from gen_data.exporters.parquet_tables import (
    GROUP_ROWS,
    IMAGE,
    list_feature,
    open_parquet,
    table_schema,
    value_feature,
)
from gen_data.exporters.sensor_selection import photographs, rgb_camera, rgb_cameras, stamp_s

if TYPE_CHECKING:
    import pyarrow
    from pyarrow.parquet import ParquetWriter

IMAGES = "images"
DECIMALS = 9
SPLIT_NAMES = {"val": "validation"}
"""Names in ``datasets``; scripts that find none of this name split the training set at random."""
GROUP_BYTES = 64_000_000
"""Image bytes of a row group after which the next one begins."""
WIDE = frozenset(
    {
        capture.Channel.FLOW_FORWARD,
        capture.Channel.FLOW_BACKWARD,
        capture.Channel.SCENE_FLOW,
        capture.Channel.MIRRORED_POSITION,
        capture.Channel.OBJECT_COORDINATES,
    }
)
"""Channels with three 16-bit components, which Pillow cannot decode."""


class HuggingFace(base.ExporterBase):
    """Parquet files with embedded images, for ``datasets.load_dataset``.

    Attributes:
        rows_per_file: Images in each file except the last one of a split.
        license: Licence of the data set in the card, as an identifier of the Hugging Face Hub.
    """

    type: Literal["huggingface"] = "huggingface"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5", box=EDGES, lens="any; column `lens`", time=READING
    )
    annotators: ClassVar[frozenset[str]] = frozenset({"instance_masks"})

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    rows_per_file: int = Field(1000, ge=1, le=1_000_000)
    license: str = Field("other", pattern=r"^[a-z0-9.-]+$")

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: no sensor writes the rgb channel, or a library is missing.
        """
        base.check_installed(self.type, "pyarrow")
        rgb_camera(info, "", self.type)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write one JSON line per image."""
        self.check(info)
        rows = (
            {"split": sample.split, "row": _row(info, sample, sensor)}
            for sample, sensor in photographs(info, samples)
        )
        fragments.write_fragment(shard_dir / self.type, IMAGES, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write the Parquet files of each split, and the card."""
        lines = fragments.fragment_rows(shard_dirs, self.type, IMAGES)
        totals = Counter(line["split"] for _, line in lines)
        schema = table_schema(table_features(info))
        splits = {
            split: _SplitFiles(dataset_dir / "data", split, totals[split], schema, self)
            for split in sorted(totals)
        }
        for shard_dir, line in fragments.fragment_rows(shard_dirs, self.type, IMAGES):
            row = line["row"] | _images(info, shard_dir, line["row"])
            splits[line["split"]].add(row)
        for files in splits.values():
            files.close()
        sequences.write_text(dataset_dir / "README.md", self._card(info, splits))

    def _card(self, info: DatasetInfo, splits: "Mapping[str, _SplitFiles]") -> str:
        """Dataset card; ``datasets`` ignores splits without ``num_bytes``."""
        facts = {
            "license": self.license,
            "pretty_name": info.name,
            "task_categories": ["object-detection", "image-segmentation"],
            "tags": ["synthetic"],
            "configs": [
                {
                    "config_name": "default",
                    "data_files": [
                        {"split": SPLIT_NAMES.get(split, split), "path": f"data/{split}-*"}
                        for split in splits
                    ],
                }
            ],
            "dataset_info": {
                "splits": [
                    {
                        "name": SPLIT_NAMES.get(split, split),
                        "num_bytes": files.bytes,
                        "num_examples": files.total,
                    }
                    for split, files in splits.items()
                ],
                "download_size": sum(files.size_bytes() for files in splits.values()),
                "dataset_size": sum(files.bytes for files in splits.values()),
            },
        }
        header = yaml.safe_dump(facts, sort_keys=False, allow_unicode=True, width=100)
        return f"---\n{header}---\n\n" + _CARD.format(
            name=info.name,
            seed=info.seed,
            images=sum(files.total for files in splits.values()),
            cameras=", ".join(rgb_cameras(info)),
            categories=", ".join(info.categories),
            scale=info.depth_scale_m,
            lens=_LENS_LINE if has_bent_camera(info) else "",
            conventions="\n".join(f"* {k}: {v}" for k, v in self.conventions.facts().items()),
        )


@dataclass(eq=False)
class _SplitFiles:
    """Parquet files of one split, written row group by row group.

    Attributes:
        total: Number of its rows.
        bytes: Size of its rows in memory [byte].
    """

    folder: Path
    split: str
    total: int
    schema: "pyarrow.Schema"
    style: HuggingFace
    bytes: int = 0
    _written: int = 0
    _group: list[dict[str, Any]] = field(default_factory=list)
    _group_bytes: int = 0
    _writer: "ParquetWriter | None" = None

    def add(self, row: dict[str, Any]) -> None:
        self._group.append(row)
        self._group_bytes += sum(_png_size(value) for value in row.values())
        is_full = len(self._group) == GROUP_ROWS or self._group_bytes >= GROUP_BYTES
        file_ends = (self._written + len(self._group)) % self.style.rows_per_file == 0
        if is_full or file_ends:
            self._write_group()
        if file_ends:
            self._close_file()

    def close(self) -> None:
        self._write_group()
        self._close_file()

    def size_bytes(self) -> int:
        return sum(path.stat().st_size for path in self.folder.glob(f"{self.split}-*"))

    def _write_group(self) -> None:
        import pyarrow

        if not self._group:
            return
        table = pyarrow.Table.from_pylist(self._group, self.schema)
        self._open().write_table(table, row_group_size=len(self._group))
        self.bytes += table.nbytes
        self._written += len(self._group)
        self._group, self._group_bytes = [], 0

    def _open(self) -> "ParquetWriter":
        if self._writer is None:
            per_file = self.style.rows_per_file
            name = fragments.numbered_stem(self.split, self._written, self.total, per_file)
            path = self.folder / f"{name}.parquet"
            self._writer = open_parquet(path, self.schema)
        return self._writer

    def _close_file(self) -> None:
        if self._writer is not None:
            self._writer.close()
            self._writer = None


LENS = {
    "model": value_feature("string"),
    "distortion": list_feature(value_feature("float64")),
    "half_field_rad": value_feature("float64"),
}
"""Feature of a lens."""


def table_features(info: DatasetInfo) -> dict[str, Any]:
    """Features by column, in the JSON form of ``datasets``."""
    others = sorted({c for s in rgb_cameras(info) for c in info.media[s]} - {capture.Channel.RGB})
    return {
        "image": IMAGE,
        **{c.value: value_feature("binary") if c in WIDE else IMAGE for c in others},
        "image_id": value_feature("int64"),
        "width": value_feature("int32"),
        "height": value_feature("int32"),
        "sample": value_feature("int64"),
        "scene": value_feature("int64"),
        "view": value_feature("int32"),
        "step": value_feature("int32"),
        "time_s": value_feature("float64"),
        "sensor": value_feature("string"),
        "K": list_feature(value_feature("float64"), 9),
        **({"lens": LENS} if has_bent_camera(info) else {}),
        "T_world_camera": list_feature(value_feature("float64"), 16),
        "objects": {k: list_feature(feature) for k, feature in object_features(info).items()},
    }


def object_features(info: DatasetInfo) -> dict[str, Any]:
    """Features of one object."""
    return {
        "id": value_feature("int64"),
        "instance_id": value_feature("int32"),
        "category": {"names": list(info.categories), "_type": "ClassLabel"},
        "bbox": list_feature(value_feature("float32"), 4),
        "area": value_feature("int64"),
        "iscrowd": value_feature("bool"),
        "rle": value_feature("string"),
        "visible_fraction": value_feature("float32"),
        "occlusion": value_feature("float32"),
        "truncation": value_feature("float32"),
        "box3d": list_feature(value_feature("float32")),
    }


def _row(info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
    camera = sample.truth[sensor].camera
    objects = [
        _object(sample, sensor, thing)
        for thing in sample.truth[sensor].objects
        if thing.box is not None and not thing.ignored
    ]
    return {
        "image_id": sample.image_id(sensor),
        "width": camera.intrinsics.width_px,
        "height": camera.intrinsics.height_px,
        "sample": sample.index,
        "scene": sample.scene_index,
        "view": sample.view_index,
        "step": sample.step_index,
        "time_s": round(stamp_s(sample, sensor), DECIMALS),
        "sensor": sensor,
        "K": camera.intrinsics.matrix().ravel().tolist(),
        **({"lens": _lens(camera.intrinsics.lens)} if has_bent_camera(info) else {}),
        "T_world_camera": reported(camera).T_world_camera.matrix().ravel().tolist(),
        "objects": {name: [o[name] for o in objects] for name in object_features(info)},
    }


def _lens(lens: Lens) -> dict[str, Any] | None:
    """Value of the column of lenses; None for a pinhole."""
    known = lens_fields(lens).get("lens")
    return None if known is None else {name: known.get(name) for name in LENS}


def _object(sample: Sample, sensor: str, thing: ObjectTruth) -> dict[str, Any]:
    assert thing.box is not None, "invisible objects are not listed"
    assert thing.mask is not None, "the annotation instance_masks is in `needs`"
    camera, box = sample.truth[sensor].camera.intrinsics, thing.box
    return {
        "id": sample.annotation_id(sensor, thing.instance.instance_id),
        "instance_id": thing.instance.instance_id,
        "category": thing.instance.category_id - 1,
        "bbox": [box.x_min, box.y_min, box.width_px, box.height_px],
        "area": thing.visible_px,
        "iscrowd": False,
        "rle": rle.encode_rle(thing.mask, camera.height_px, camera.width_px)["counts"],
        "visible_fraction": thing.visible_fraction,
        "occlusion": thing.occlusion,
        "truncation": thing.truncation,
        "box3d": None if thing.box3d_camera is None else _box3d(thing.box3d_camera),
    }


def _box3d(box: boxes.OrientedBox) -> list[float]:
    """Centre, full size, quaternion w x y z."""
    pose = box.T_frame_box
    return [*pose.translation_m, *box.size_m, *pose.quaternion_wxyz]


def _images(info: DatasetInfo, shard_dir: Path, row: Mapping[str, Any]) -> dict[str, Any]:
    """Image columns of a row; a channel that the camera does not write has none."""
    columns: dict[str, Any] = {}
    for channel in info.media[row["sensor"]]:
        path = info.media_path(shard_dir, row["sensor"], channel, row["sample"])
        name = "image" if channel is capture.Channel.RGB else channel.value
        file_name = f"{path.stem}_{row['sensor']}{path.suffix}"
        data = path.read_bytes()
        columns[name] = data if channel in WIDE else {"bytes": data, "path": file_name}
    return columns


def _png_size(value: Any) -> int:
    """Size of an image column's value [byte]; 0 for any other."""
    data = value.get("bytes", b"") if isinstance(value, dict) else value
    return len(data) if isinstance(data, bytes) else 0


_LENS_LINE = """
| `lens` | before `K`: `model`, `distortion` in the order of OpenCV's functions, null = pinhole |"""

_CARD = """# {name}

Synthetic images with exact labels, generated by gen-data from a configuration and seed {seed}:
{images} images of the cameras {cameras}.

Categories: {categories}.

| column | content |
|---|---|
| `image` | 8-bit sRGB |
| `depth`, `range` | 16-bit, {scale} m per unit; 0 = nothing |
| `instance`, `part`, `category` | 16-bit ids; 0 = nothing |
| `depth_layers`, `instance_layers`, `material_layers` | 16-bit, all layers below one another |
| `objects.bbox` | x, y, width, height [px] of the visible pixels; pixel i covers [i, i + 1) |
| `objects.category` | index from 0 into the names of the feature |
| `objects.rle` | COCO's compressed runs of the visible mask, of size height x width |
| `objects.visible_fraction` | visible pixels / pixels of the whole silhouette |
| `objects.box3d` | camera frame: centre [m], size [m], quaternion w x y z |
| `K` | 3 x 3, row by row; the centre of pixel i is i + 0.5 |{lens}
| `T_world_camera` | 4 x 4, row by row; camera X right, Y down, Z forward; metres |

Conventions:

{conventions}

Objects without a visible pixel are not listed. `LICENSES-ASSETS.md` of the data set lists the
licences of the assets in its scenes.
"""
