"""Names of the files and folders of a data set.

plan.json               identity of the data set; written first
shards/000042/          files of one shard, renamed into place when all are on disk
shards/000042.json      its record; from here on the shard is committed
coco/ kitti/ ...        merged results of exporters
README.md               data card; croissant.json: its facts for programs
SHA256SUMS              every file but run/, certificates and itself, for ``sha256sum -c``
manifest.json           written last: it marks the data set as finished
CERTIFICATE.json        results of ``gen-data certify``, with a page; no part of the data set
run/                    lock, log, a copy of the plan, unfinished and quarantined files; no part
                        of the data set
"""

from pathlib import Path

PLAN_NAME = "plan.json"
MANIFEST_NAME = "manifest.json"
SUMS_NAME = "SHA256SUMS"
LICENCES_NAME = "LICENSES-ASSETS.md"
RUN_NAME = "run"
LOG_NAME = "log.jsonl"
"""Log of all runs, in ``run``: committed shards with digests of their records, and summaries."""
CERTIFICATE_NAME = "CERTIFICATE.json"
CERTIFICATE_NAMES = (CERTIFICATE_NAME, "CERTIFICATE.html")
"""Statements about a finished data set, next to its manifest; no part of its identity."""
SHARDS_NAME = "shards"


def shard_path(root: Path, shard: int) -> Path:
    """Path of the folder of a committed shard."""
    return root / SHARDS_NAME / f"{shard:06d}"


def record_path(root: Path, shard: int) -> Path:
    """Path of the record of a committed shard."""
    return root / SHARDS_NAME / f"{shard:06d}.json"
