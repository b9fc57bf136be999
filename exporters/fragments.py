"""Fragments: the JSON lines that an exporter writes into a shard and merges at the end.

A fragment is a file ``<shard>/<exporter>/<name>.jsonl``. Shards are merged in the order of their
samples: the merged data set does not depend on the size of shards.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from gen_data.core.serialization import canonical_json


def write_fragment(folder: Path, name: str, rows: Iterable[Mapping[str, Any]]) -> None:
    """Write the rows of one shard to ``<folder>/<name>.jsonl``; creates the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    text = "".join(canonical_json(row) + "\n" for row in rows)
    (folder / f"{name}.jsonl").write_text(text, encoding="utf-8", newline="\n")


def write_fragments(folder: Path, rows: Mapping[str, Iterable[Mapping[str, Any]]]) -> None:
    """Write the rows of one shard by name of their fragment; creates the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, lines in rows.items():
        write_fragment(folder, name, lines)


def image_splits(folders: Iterable[Path]) -> list[str]:
    """Sorted splits with a fragment ``<split>.images.jsonl`` in any shard."""
    return sorted({p.name.split(".")[0] for f in folders for p in f.glob("*.images.jsonl")})


def fragment_lines(folders: Iterable[Path], name: str) -> Iterator[str]:
    """Lines of all shards, without line ends; a shard without the fragment has none."""
    for folder in folders:
        path = folder / f"{name}.jsonl"
        if path.exists():
            with path.open(encoding="utf-8", newline="\n") as file:
                for line in file:
                    yield line.rstrip("\n")


def fragment_rows(
    shard_dirs: Sequence[Path], exporter: str, name: str
) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Rows of all shards, each with the folder of its shard, which holds the images."""
    for shard_dir in shard_dirs:
        for line in fragment_lines([shard_dir / exporter], name):
            yield shard_dir, json.loads(line)


def split_rows(
    shard_dirs: Sequence[Path], exporter: str
) -> Iterator[tuple[str, Iterator[tuple[Path, dict[str, Any]]]]]:
    """Splits with images, sorted, each with its rows as ``fragment_rows`` yields them."""
    for split in image_splits([shard_dir / exporter for shard_dir in shard_dirs]):
        yield split, fragment_rows(shard_dirs, exporter, f"{split}.images")


def numbered_stem(split: str, position: int, total: int, per_file: int) -> str:
    """Name of the file with row ``position`` of a split, such as ``train-00002-of-00005``."""
    return f"{split}-{position // per_file:05d}-of-{-(-total // per_file):05d}"
