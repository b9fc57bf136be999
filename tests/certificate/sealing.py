"""Seals of damaged data sets: all checksums match the files again."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from gen_data.runner.shard_record import FileRecord, parse_unchecked_record

SMALL: dict[str, Any] = {
    "overrides": ("sensors[0].size_px=[96, 72]", "shard_size=16", "views_per_scene=2",
                  "randomizers.clutter.count={uniform_integer: [1, 3]}",
                  "splits={train: 0.5, val: 0.25, test: 0.25, assign: round_robin}",
                  "exporters=[{type: coco}]"),
    "without": ("distractors", "tabletop", "cover", "finish"),
}  # fmt: skip
"""Changes that make a data set quick to generate."""


def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def reseal(folder: Path) -> None:
    """Recompute records, sums and manifest, as a run with these files would have written them."""
    manifest = json.loads((folder / "manifest.json").read_bytes())
    sized: set[str] = set()
    for number in range(len(manifest["shards"])):
        path = folder / f"shards/{number:06d}.json"
        record = parse_unchecked_record(path.read_bytes())
        assert record is not None
        shard = folder / f"shards/{number:06d}"
        paths = sorted(p.relative_to(shard).as_posix() for p in shard.rglob("*") if p.is_file())
        files = tuple(_describe(shard, p) for p in paths)
        data = replace(record, files=files).to_bytes()
        path.write_bytes(data)
        manifest["shards"][number] = digest(data)
        sized.update(f.sha256 for f in files)
    names = sorted(
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and path.relative_to(folder).parts[0] not in ("run", *UNSEALED)
    )
    sums = {name: digest((folder / name).read_bytes()) for name in names}
    text = "".join(f"{value}  {name}\n" for name, value in sums.items())
    manifest["dataset_id"] = digest(text.encode())
    manifest["files"] = {
        name: (folder / name).stat().st_size for name, value in sums.items() if value not in sized
    }
    plain = json.dumps(manifest, separators=(",", ":"), sort_keys=True, ensure_ascii=False)
    (folder / "manifest.json").write_text(plain + "\n", encoding="utf-8")
    sums["manifest.json"] = digest((folder / "manifest.json").read_bytes())
    lines = (f"{value}  {name}\n" for name, value in sorted(sums.items()))
    (folder / "SHA256SUMS").write_text("".join(lines), encoding="utf-8")


def edit_lines(path: Path, change: Callable[[int, dict[str, Any]], None]) -> None:
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    for number, row in enumerate(rows):
        change(number, row)
    lines = (json.dumps(r, separators=(",", ":"), sort_keys=True) + "\n" for r in rows)
    path.write_text("".join(lines))


UNSEALED = ("manifest.json", "SHA256SUMS", "CERTIFICATE.json", "CERTIFICATE.html")


def _describe(folder: Path, name: str) -> FileRecord:
    data = (folder / name).read_bytes()
    return FileRecord(name, len(data), digest(data))
