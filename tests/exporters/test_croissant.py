"""Croissant export: tables by themselves, metadata by the package mlcroissant."""

import hashlib
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from gen_data.core.interfaces import DatasetInfo, Publication
from gen_data.exporters.croissant import Croissant
from tests.exporters.datasets import made_of
from tests.exporters.label_readers import csv_rows


def published(world: Any, licence: str = "") -> DatasetInfo:
    publication = Publication(
        license=licence,
        url="https://example.org",
        cite_as="nobody",
        date_published="2026-01-31",
        creators=("A. Author",),
    )
    return replace(world.info(7), publication=publication)


dataset = made_of(Croissant(), lambda world: (published(world), world.samples))


def test_tables_list_images_and_objects_described_with_sums(dataset: Path, world: Any) -> None:
    """Ids are COCO's; the empty frame has an image and no object."""
    images, objects = csv_rows(dataset / "images.csv"), csv_rows(dataset / "objects.csv")
    assert [int(row["image_id"]) for row in images] == [s.image_id("color") for s in world.samples]
    assert {row["image_id"] for row in objects} < {row["image_id"] for row in images}
    names = [row["name"] for row in csv_rows(dataset / "categories.csv")]
    assert names == list(world.categories)
    metadata = json.loads((dataset / "croissant.json").read_text())
    files = [f for f in metadata["distribution"] if f["@type"] == "cr:FileObject"]
    assert [f["contentUrl"] for f in files] == ["images.csv", "objects.csv", "categories.csv"]
    for file in files:
        data = (dataset / file["contentUrl"]).read_bytes()
        assert file["sha256"] == hashlib.sha256(data).hexdigest()
        assert file["contentSize"] == f"{len(data)} B"


def test_licences_are_those_of_assets_or_of_the_publisher(world: Any, tmp_path: Path) -> None:
    """The sky of the scenes is CC0; a licence of the data set replaces it."""
    stated = []
    for number, licence in enumerate(("", "CC-BY-4.0")):
        info = published(world, licence)
        folder = world.export(Croissant(), info, world.samples, tmp_path / str(number))
        stated.append(json.loads((folder / "croissant.json").read_text())["license"])
    assert stated == ["CC0-1.0", "CC-BY-4.0"]
