"""Croissant: machine-readable description of the images and objects, and a data card.

::

    croissant.json               JSON-LD of MLCommons' Croissant 1.0
    README.md                    data card: counts, sensors, definitions of labels, provenance
    images.csv, objects.csv      a line per image and per visible object
    categories.csv               ids from 1, and names
    images/<split>/000000012_color.png

Record sets: ``images`` (a line of ``images.csv`` with the pixels as ``content``), ``objects``
(a line of ``objects.csv``) and ``categories``. Ids and boxes equal those of the exporter ``coco``;
``fx fy cx cy`` are for image coordinates in which pixel ``i`` covers ``[i, i + 1)``.

The licence of a data set is its publisher's decision, the field ``license``; without it the
licences of the assets in its scenes are stated.

Reference: https://docs.mlcommons.org/croissant/docs/croissant-spec.html.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

import yaml
from pydantic import PrivateAttr

from gen_data.exporters.base import ExporterBase
from gen_data.exporters.fragments import fragment_rows, write_fragment
from gen_data.exporters.image_files import link_or_copy
from gen_data.exporters.sensor_selection import rgb_cameras
from gen_data.exporters.sequences import write_text
from gen_data.generator import __version__
from gen_data.generator.core.capture import Channel
from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.interfaces import AssetLibrary, DatasetInfo, SensorInfo, media_path
from gen_data.generator.core.sample import Sample
from gen_data.generator.core.scene_assets import assets_in

IMAGES, ASSETS = "images", "assets"
CONFORMS_TO = "http://mlcommons.org/croissant/1.0"
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


class Croissant(ExporterBase):
    """Croissant metadata with a data card.

    Attributes:
        license: Licence of the data set: an SPDX identifier or a URL; empty = those of its assets.
        url: Web page of the data set.
        creator: Name of its creator.
        date_published: Date of publication, such as ``2026-11-22``.
        cite_as: Citation, such as a BibTeX entry.
    """

    type: Literal["croissant"] = "croissant"
    license: str = ""
    url: str = ""
    creator: str = ""
    date_published: str = ""
    cite_as: str = ""

    _assets: AssetLibrary | None = PrivateAttr(None)

    def with_assets(self, assets: AssetLibrary) -> Croissant:
        """Return the exporter with a library that knows the licences of assets."""
        bound = self.model_copy()
        bound._assets = assets
        return bound

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: no sensor writes the rgb channel.
        """
        if not rgb_cameras(info):
            raise ConfigError(
                f"exporter '{self.type}': no sensor writes the rgb channel; add an rgb_camera"
            )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write a JSON line per image, and one per asset."""
        self.check(info)
        rows, assets = [], set()
        for sample in samples:
            assets |= assets_in(sample.scene)
            rows += [_row(sample, s) for s in rgb_cameras(info) if s in sample.truth]
        folder = shard_dir / self.type
        write_fragment(folder, IMAGES, rows)
        write_fragment(folder, ASSETS, ({"asset": asset} for asset in sorted(assets)))

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write tables, metadata and card, and link the images."""
        dataset_dir.mkdir(parents=True, exist_ok=True)
        counts = _Counts()
        with (
            _CsvFile(dataset_dir / "images.csv", IMAGE_COLUMNS) as images,
            _CsvFile(dataset_dir / "objects.csv", OBJECT_COLUMNS) as objects,
            _CsvFile(dataset_dir / "categories.csv", CATEGORY_COLUMNS) as categories,
        ):
            for number, name in enumerate(info.categories, 1):
                categories.write({"category_id": number, "name": name})
            for shard_dir, row in fragment_rows(shard_dirs, self.type, IMAGES):
                image = row["image"]
                images.write(image)
                objects.write_all(row["objects"])
                counts.add(row)
                source = media_path(shard_dir, image["sensor"], Channel.RGB, image["sample"])
                target = dataset_dir / "images" / image["split"] / image["file_name"]
                link_or_copy(source, target)
        licences = self._licences(shard_dirs)
        metadata = self._metadata(info, [images, objects, categories], licences)
        text = json.dumps(metadata, indent=2, ensure_ascii=False) + "\n"
        write_text(dataset_dir / "croissant.json", text)
        write_text(dataset_dir / "README.md", self._card(info, counts, licences))

    def _licences(self, shard_dirs: Sequence[Path]) -> list[str]:
        """Licence of the data set, or those of its assets, sorted."""
        if self.license:
            return [self.license]
        assert self._assets is not None, "call with_assets first"
        used = {row["asset"] for _, row in fragment_rows(shard_dirs, self.type, ASSETS)}
        return sorted({self._assets.get(asset).licence for asset in used})

    def _metadata(
        self, info: DatasetInfo, tables: Sequence[_CsvFile], licences: Sequence[str]
    ) -> dict[str, Any]:
        """Content of ``croissant.json``."""
        optional = {
            "url": self.url,
            "creator": {"@type": "sc:Person", "name": self.creator} if self.creator else "",
            "datePublished": self.date_published,
            "citeAs": self.cite_as,
        }
        return {
            "@context": _read_context(),
            "@type": "sc:Dataset",
            "name": info.name,
            "description": _description(info),
            "conformsTo": CONFORMS_TO,
            "license": licences[0] if len(licences) == 1 else list(licences),
            "version": "1.0.0",
            **{key: value for key, value in optional.items() if value},
            "distribution": [
                *(table.described() for table in tables),
                {
                    "@type": "cr:FileSet",
                    "@id": "image-files",
                    "name": "image-files",
                    "description": "Photographs, 8-bit sRGB.",
                    "encodingFormat": "image/png",
                    "includes": "images/*/*.png",
                },
            ],
            "recordSet": [
                _image_records(),
                _table_records("objects", "Visible objects.", OBJECT_COLUMNS),
                _table_records("categories", "Names of the categories.", CATEGORY_COLUMNS),
            ],
        }

    def _card(self, info: DatasetInfo, counts: _Counts, licences: Sequence[str]) -> str:
        """Content of ``README.md``."""
        splits = sorted(counts.images)
        rows = [
            f"| {split} | {counts.scenes[split]} | {counts.images[split]} "
            f"| {sum(counts.objects[split].values())} |"
            for split in splits
        ]
        categories = [
            f"| {number} | {name} | "
            + " | ".join(str(counts.objects[split][name]) for split in splits)
            + " |"
            for number, name in enumerate(info.categories, 1)
        ]
        return _CARD.format(
            name=info.name,
            description=_description(info),
            splits="\n".join(rows),
            split_names=" | ".join(splits),
            split_lines="|".join("---" for _ in splits),
            categories="\n".join(categories),
            sensors="\n".join(_sensor_line(sensor) for sensor in info.sensors),
            scale=info.depth_scale_m,
            licences="\n".join(f"- {licence}" for licence in licences),
            licence_of="The data set" if self.license else "The assets in its scenes",
            seed=info.seed,
            n=info.n,
            views=info.views_per_scene,
            steps=info.steps_per_scene,
            step_s=info.step_s,
            version=__version__,
        )


@dataclass
class _Counts:
    """Numbers of scenes and images by split, of objects by split and category."""

    scenes: Counter[str] = field(default_factory=Counter)
    images: Counter[str] = field(default_factory=Counter)
    objects: dict[str, Counter[str]] = field(default_factory=dict)
    _scene: int = -1

    def add(self, row: Mapping[str, Any]) -> None:
        """Count an image; images come in the order of their scenes."""
        split, scene = row["image"]["split"], row["image"]["scene"]
        self.images[split] += 1
        self.scenes[split] += scene != self._scene
        self._scene = scene
        found = self.objects.setdefault(split, Counter())
        found.update(thing["category"] for thing in row["objects"])


class _CsvFile:
    """A CSV file that is written row by row and hashed on the way."""

    def __init__(self, path: Path, columns: Mapping[str, str]) -> None:
        self._path, self._columns = path, columns
        self._sha256 = hashlib.sha256()
        self._bytes = 0

    def __enter__(self) -> _CsvFile:
        """Open the file and write the header."""
        self._file = self._path.open("wb")
        self.write({name: name for name in self._columns})
        return self

    def __exit__(self, *exception: object) -> None:
        """Close the file."""
        self._file.close()

    def write(self, row: Mapping[str, Any]) -> None:
        """Append a line."""
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerow(row[name] for name in self._columns)
        data = text.getvalue().encode()
        self._file.write(data)
        self._sha256.update(data)
        self._bytes += len(data)

    def write_all(self, rows: Iterable[Mapping[str, Any]]) -> None:
        """Append lines."""
        for row in rows:
            self.write(row)

    def described(self) -> dict[str, Any]:
        """The file as a ``FileObject``."""
        return {
            "@type": "cr:FileObject",
            "@id": self._path.name,
            "name": self._path.name,
            "contentUrl": self._path.name,
            "contentSize": f"{self._bytes} B",
            "encodingFormat": "text/csv",
            "sha256": self._sha256.hexdigest(),
        }


def _row(sample: Sample, sensor: str) -> dict[str, Any]:
    """Lines of both tables for one image."""
    camera = sample.truth[sensor].camera.intrinsics
    image_id = sample.image_id(sensor)
    image = {
        "image_id": image_id,
        "file_name": f"{sample.index:09d}_{sensor}.png",
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


def _read_context() -> dict[str, Any]:
    """Read the terms of Croissant, the JSON-LD context."""
    text = (files("gen_data.exporters") / "croissant_context.yaml").read_text("utf-8")
    context: dict[str, Any] = yaml.safe_load(text)
    return context


def _description(info: DatasetInfo) -> str:
    return (
        f"Synthetic images with exact labels, rendered by gen-data from the configuration "
        f"'{info.name}' with seed {info.seed}."
    )


def _image_records() -> dict[str, Any]:
    """Record set of the images; file names join the table and the files."""
    records = _table_records(
        "images", "Images with the intrinsics of their cameras.", IMAGE_COLUMNS
    )
    source = {"fileSet": {"@id": "image-files"}}
    for column in records["field"]:
        if column["@id"] == "images/file_name":
            column["references"] = {**source, "extract": {"fileProperty": "filename"}}
    content = {
        "@type": "cr:Field",
        "@id": "images/content",
        "name": "images/content",
        "dataType": "sc:ImageObject",
        "source": {**source, "extract": {"fileProperty": "content"}},
    }
    return {**records, "field": [*records["field"], content]}


def _table_records(name: str, description: str, columns: Mapping[str, str]) -> dict[str, Any]:
    """Record set of the lines of a CSV file."""
    return {
        "@type": "cr:RecordSet",
        "@id": name,
        "name": name,
        "description": description,
        "key": {"@id": f"{name}/{next(iter(columns))}"},
        "field": [
            {
                "@type": "cr:Field",
                "@id": f"{name}/{column}",
                "name": f"{name}/{column}",
                "dataType": kind,
                "source": {"fileObject": {"@id": f"{name}.csv"}, "extract": {"column": column}},
            }
            for column, kind in columns.items()
        ],
    }


def _sensor_line(sensor: SensorInfo) -> str:
    """Line of the card's table of sensors."""
    kind = sensor.kind or sensor.modality.value
    parts = ", ".join(channel.value for channel in sensor.channels)
    parts = parts or ", ".join(column.name for column in sensor.columns)
    rate = f"{sensor.rate_hz:g} Hz" if sensor.rate_hz is not None else "every step"
    return f"| {sensor.name} | {kind} | {parts} | {rate} |"


_CARD = """# {name}

{description}

## Contents

| split | scenes | images | visible objects |
|---|---|---|---|
{splits}

Visible objects by category:

| id | category | {split_names} |
|---|---|{split_lines}|
{categories}

## Sensors

| sensor | kind | channels or columns | rate |
|---|---|---|---|
{sensors}

## Labels

- Labels come from the geometry of the scene: the ray through a pixel's centre decides its labels.
- Boxes are tight around the visible pixels of an object; pixel i covers [i, i + 1). Objects without
  a visible pixel are not listed.
- Depth images have {scale} m per unit; 0 = nothing.
- Cameras have X right, Y down, Z forward; the world has Z up; units are metres, seconds, radians.
- Ids of instances are the same in all views of a scene. Splits are drawn per scene.

## Provenance

gen-data {version} with seed {seed}: {n} samples, {views} views per scene and {steps} steps per
view, {step_s} s apart. `plan.json` of the data set has the whole configuration. No image shows a
real place or person, except for photographed panoramas and scanned assets that the configuration
may name.

## Licence

{licence_of}:

{licences}

`LICENSES-ASSETS.md` of the data set lists sources and authors of all assets.
"""
