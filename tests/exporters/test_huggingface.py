"""Hugging Face export: Parquet files, read by pyarrow and by the package datasets."""

import re
from pathlib import Path
from typing import Any

import pyarrow
import pyarrow.parquet
import pytest
import yaml

from gen_data.exporters import huggingface
from gen_data.exporters.huggingface import HuggingFace
from tests.exporters.datasets import made_of
from tests.exporters.label_readers import parquet

dataset = made_of(HuggingFace(rows_per_file=2))


def test_parquet_files_embed_images_and_name_and_card_count_them(dataset: Path, world: Any) -> None:
    """Read by pyarrow alone: the bytes are of the shards' PNG files."""
    rows = [r for p in sorted((dataset / "data").glob("train-*")) for r in parquet(p).to_pylist()]
    train = [s for s in world.samples if s.split == "train"]
    assert [row["image_id"] for row in rows] == [s.image_id("color") for s in train]
    for row, truth in zip(rows, train, strict=True):
        assert row["image"]["path"] == f"{truth.index:09d}_color.png"
        shard = dataset.parent / f"shards/{truth.index // 3:06d}/color"
        for column, channel in (("image", "rgb"), ("depth", "depth")):
            stored = (shard / channel / f"{truth.index:09d}.png").read_bytes()
            assert row[column]["bytes"] == stored
    # Names have the number of files of their split; no other file is there.
    names = sorted(p.name for p in (dataset / "data").iterdir())
    assert names == [
        *(f"train-{k:05d}-of-00003.parquet" for k in range(3)),
        "val-00000-of-00001.parquet",
    ]
    assert sorted(p.name for p in dataset.iterdir()) == ["README.md", "data"]
    # Without num_bytes, datasets ignores a split's numbers.
    facts = card(dataset)
    assert facts["license"] == "other"
    (files,) = (config["data_files"] for config in facts["configs"])
    named = {"train": "train", "validation": "val"}
    assert files == [{"split": k, "path": f"data/{s}-*"} for k, s in named.items()]
    splits = facts["dataset_info"]["splits"]
    assert [(s["name"], s["num_examples"]) for s in splits] == [("train", 5), ("validation", 2)]
    assert all(s["num_bytes"] > 1000 for s in splits)
    sizes = [p.stat().st_size for p in (dataset / "data").iterdir()]
    assert facts["dataset_info"]["download_size"] == sum(sizes)


def test_groups_are_bounded(world: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By rows and by bytes of images."""
    monkeypatch.setattr(huggingface, "GROUP_ROWS", 3)
    folder = world.export(HuggingFace(), world.info(7), world.samples, tmp_path / "a")
    by_rows = pyarrow.parquet.ParquetFile(folder / "data/train-00000-of-00001.parquet").metadata
    monkeypatch.setattr(huggingface, "GROUP_BYTES", 1)
    folder = world.export(HuggingFace(), world.info(7), world.samples, tmp_path / "b")
    by_bytes = pyarrow.parquet.ParquetFile(folder / "data/train-00000-of-00001.parquet").metadata
    assert [by_rows.row_group(k).num_rows for k in range(by_rows.num_row_groups)] == [3, 2]
    assert by_bytes.num_row_groups == 5


def test_flow_is_binary_missing_values_null_and_ignored_left_out(
    world: Any, tmp_path: Path
) -> None:
    """Pillow would decode flow to 8 bits; the right camera writes none."""
    info, samples = world.pairs()
    folder = world.export(HuggingFace(), info, samples, tmp_path / "pairs")
    table = parquet(folder / "data/train-00000-of-00001.parquet")
    rows = table.to_pylist()
    assert table.schema.field("flow_forward").type == pyarrow.binary()
    assert [row["sensor"] for row in rows] == ["left", "right"] * 4
    for row in rows:
        assert (row["flow_forward"] is not None) == (row["sensor"] == "left")
        assert row["image"]["bytes"].startswith(b"\x89PNG")
    ignored = world.ignoring(world.samples[0])
    folder = world.export(HuggingFace(), world.info(1), [ignored], tmp_path)
    (row,) = parquet(folder / "data/train-00000-of-00001.parquet").to_pylist()
    _, *others = ignored.truth["color"].objects
    assert row["objects"]["instance_id"] == [t.instance.instance_id for t in others]
    assert not any(row["objects"]["iscrowd"])


def card(folder: Path) -> Any:
    header = re.match(r"---\n(.*?)\n---\n", (folder / "README.md").read_text(), re.DOTALL)
    assert header
    return yaml.safe_load(header.group(1))
