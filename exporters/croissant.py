"""Croissant: tables of images and objects with metadata that joins them with the pixels.

::

    croissant.json               JSON-LD of MLCommons' Croissant 1.0
    images.csv, objects.csv      a line per image and per visible object
    categories.csv               ids from 1, and names
    images/<split>/000000012_color.png

Record sets: ``images`` (a line of ``images.csv`` with the pixels as ``content``), ``objects``
(a line of ``objects.csv``) and ``categories``. Ids and boxes equal the exporter ``coco``'s;
``fx fy cx cy`` are for image coordinates in which pixel ``i`` covers ``[i, i + 1)``. Data sets with
a bent camera have the columns ``lens``, its model, and ``distortion``: coefficients
in the order of OpenCV's functions, separated by spaces, to be applied before ``fx fy cx cy``.

Title, licence and creators come from the section ``dataset`` of the configuration; without a
licence, the licences of the assets in the scenes are stated. Every data set has a
``croissant.json`` of its files and a data card at its root, with or without this exporter.
"""

import csv
import hashlib
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

from gen_data.core import errors, scene_assets
from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample
from gen_data.exporters.base import ANY_FORMAT, AssetExporter
from gen_data.exporters.coco import image_name
from gen_data.exporters.conventions import EDGES, Conventions
from gen_data.exporters.croissant_metadata import (
    croissant_document,
    extract,
    file_object,
    file_set,
    record_set,
)
from gen_data.exporters.fragments import fragment_rows, write_fragment
from gen_data.exporters.image_files import link_photograph
from gen_data.exporters.lens_fields import has_bent_camera
from gen_data.exporters.sensor_selection import rgb_camera, rgb_cameras
from gen_data.exporters.sequences import write_text

IMAGES, ASSETS = "images", "assets"
MIME_TYPES = {".png": "image/png", ".jpg": "image/jpeg", ".webp": "image/webp"}
"""Media types of photographs by ending."""
IMAGE_COLUMNS = {
    "image_id": "sc:Integer",
    "file_name": "sc:Text",
    "split": "sc:Text",
    "width": "sc:Integer",
    "height": "sc:Integer",
    "sample": "sc:Integer",
    "scene": "sc:Integer",
    "view": "sc:Integer",
    "step": "sc:Integer",
    "sensor": "sc:Text",
    "fx": "sc:Float",
    "fy": "sc:Float",
    "cx": "sc:Float",
    "cy": "sc:Float",
}
"""Columns of ``images.csv`` with their data types."""
LENS_COLUMNS = {"lens": "sc:Text", "distortion": "sc:Text"}
"""Further columns of ``images.csv``, of data sets with a bent camera."""
OBJECT_COLUMNS = {
    "object_id": "sc:Integer",
    "image_id": "sc:Integer",
    "instance_id": "sc:Integer",
    "category_id": "sc:Integer",
    "category": "sc:Text",
    "x": "sc:Integer",
    "y": "sc:Integer",
    "width": "sc:Integer",
    "height": "sc:Integer",
    "area": "sc:Integer",
}
"""Columns of ``objects.csv`` with their data types; x, y is the upper left corner [px]."""

CATEGORY_COLUMNS = {"category_id": "sc:Integer", "name": "sc:Text"}
"""Columns of ``categories.csv`` with their data types."""


class Croissant(AssetExporter):
    """Tables of images and objects with Croissant metadata."""

    type: Literal["croissant"] = "croissant"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5", box=EDGES, lens="any; columns `lens`, `distortion`"
    )

    image_formats: ClassVar[frozenset[str]] = ANY_FORMAT

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: no sensor writes the rgb channel, or cameras differ in their image files.
        """
        rgb_camera(info, "", self.type)
        suffixes = {info.encoding(name, Channel.RGB).suffix for name in rgb_cameras(info)}
        if len(suffixes) > 1:
            raise errors.ConfigError(
                f"exporter '{self.type}': cameras write {' and '.join(sorted(suffixes))} files; "
                "expected one format, so change rgb_encoding of a sensor"
            )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a JSON line per image, and one per asset."""
        self.check(info)
        rows, assets = [], set()
        for sample in samples:
            assets |= scene_assets.assets_in(sample.scene)
            rows += [_row(info, sample, s) for s in rgb_cameras(info) if s in sample.truth]
        folder = shard_dir / self.type
        write_fragment(folder, IMAGES, rows)
        write_fragment(folder, ASSETS, ({"asset": asset} for asset in sorted(assets)))

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write tables and metadata, and link the images."""
        dataset_dir.mkdir(parents=True, exist_ok=True)
        with (
            _CsvFile(dataset_dir / "images.csv", _image_columns(info)) as images,
            _CsvFile(dataset_dir / "objects.csv", OBJECT_COLUMNS) as objects,
            _CsvFile(dataset_dir / "categories.csv", CATEGORY_COLUMNS) as categories,
        ):
            for number, name in enumerate(info.categories, 1):
                categories.write({"category_id": number, "name": name})
            for shard_dir, row in fragment_rows(shard_dirs, self.type, IMAGES):
                image = row["image"]
                images.write(image)
                objects.write_all(row["objects"])
                target = dataset_dir / "images" / image["split"] / image["file_name"]
                link_photograph(info, shard_dir, image, target)
        tables = [table.described() for table in (images, objects, categories)]
        licences, files = self._asset_licences(shard_dirs), [*tables, _image_files(info)]
        document = croissant_document(info, licences, files, _record_sets(info))
        text = json.dumps(document, indent=2, ensure_ascii=False) + "\n"
        write_text(dataset_dir / "croissant.json", text)

    def _asset_licences(self, shard_dirs: Sequence[Path]) -> list[str]:
        used = {row["asset"] for _, row in fragment_rows(shard_dirs, self.type, ASSETS)}
        return sorted({self.library.get(asset).licence for asset in used})


class _CsvFile:
    """A CSV file that is written row by row and hashed on the way."""

    def __init__(self, path: Path, columns: Mapping[str, str]) -> None:
        self._path, self._columns = path, columns
        self._sha256 = hashlib.sha256()
        self._bytes = 0

    def __enter__(self) -> "_CsvFile":
        self._file = self._path.open("wb")
        self.write({name: name for name in self._columns})
        return self

    def __exit__(self, *exception: object) -> None:
        self._file.close()

    def write(self, row: Mapping[str, Any]) -> None:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerow(row[name] for name in self._columns)
        data = text.getvalue().encode()
        self._file.write(data)
        self._sha256.update(data)
        self._bytes += len(data)

    def write_all(self, rows: Iterable[Mapping[str, Any]]) -> None:
        for row in rows:
            self.write(row)

    def described(self) -> dict[str, Any]:
        """The file as a ``FileObject``."""
        return file_object(self._path.name, self._bytes, self._sha256.hexdigest(), "text/csv")


def _row(info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
    camera = sample.truth[sensor].camera.intrinsics
    image_id = sample.image_id(sensor)
    image = {
        "image_id": image_id,
        "file_name": image_name(sample.index, sensor, info.encoding(sensor, Channel.RGB).suffix),
        "split": sample.split,
        "width": camera.width_px,
        "height": camera.height_px,
        "sample": sample.index,
        "scene": sample.scene_index,
        "view": sample.view_index,
        "step": sample.step_index,
        "sensor": sensor,
        "fx": camera.fx_px,
        "fy": camera.fy_px,
        "cx": camera.cx_px,
        "cy": camera.cy_px,
    }
    if has_bent_camera(info):
        image["lens"] = camera.lens.model
        image["distortion"] = " ".join(map(repr, camera.lens.coefficients))
    objects = [
        {
            "object_id": sample.annotation_id(sensor, thing.instance.instance_id),
            "image_id": image_id,
            "instance_id": thing.instance.instance_id,
            "category_id": thing.instance.category_id,
            "category": thing.instance.category,
            "x": thing.box.x_min,
            "y": thing.box.y_min,
            "width": thing.box.width_px,
            "height": thing.box.height_px,
            "area": thing.visible_px,
        }
        for thing in sample.truth[sensor].objects
        if thing.box is not None and not thing.ignored
    ]
    return {"image": image, "objects": objects}


def _image_columns(info: DatasetInfo) -> dict[str, str]:
    """Columns of ``images.csv`` with their data types."""
    return IMAGE_COLUMNS | (LENS_COLUMNS if has_bent_camera(info) else {})


def _image_files(info: DatasetInfo) -> dict[str, Any]:
    """All photographs; ``check`` makes sure that they have one ending."""
    suffix = info.encoding(rgb_cameras(info)[0], Channel.RGB).suffix
    return file_set(
        "image-files", "Photographs, 8-bit sRGB.", MIME_TYPES[suffix], f"images/*/*{suffix}"
    )


def _record_sets(info: DatasetInfo) -> list[dict[str, Any]]:
    images = record_set(
        "images",
        "Images with the intrinsics of their cameras.",
        {
            **_columns("images", _image_columns(info)),
            "content": ("sc:ImageObject", extract("image-files", {"fileProperty": "content"})),
        },
    )
    for column in images["field"]:
        if column["@id"] == "images/file_name":
            # File names join the table and the files.
            column["references"] = extract("image-files", {"fileProperty": "filename"})
    return [
        images,
        record_set("objects", "Visible objects.", _columns("objects", OBJECT_COLUMNS)),
        record_set(
            "categories", "Names of the categories.", _columns("categories", CATEGORY_COLUMNS)
        ),
    ]


def _columns(table: str, columns: Mapping[str, str]) -> dict[str, tuple[str, dict[str, Any]]]:
    return {
        name: (kind, extract(f"{table}.csv", {"column": name}, is_set=False))
        for name, kind in columns.items()
    }
