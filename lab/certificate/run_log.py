"""Claim: the data set is the one that its run sealed.

``run/log.jsonl`` has the record of every shard, as it was committed, and the identity of the data
set. It is not part of the data set: whoever changes files and makes all checksums again does not
change it in passing. Pictures that are exchanged in shards and exports alike are found in all
samples, without generating any.
"""

import hashlib
from collections.abc import Iterator, Mapping
from typing import Any

from gen_data.lab.certificate.examined import Examined
from gen_data.lab.certificate.finding import Contradictions, Finding, not_checked
from gen_data.runner.layout import LOG_NAME, RUN_NAME
from gen_data.runner.seal import parse_object
from gen_data.runner.store import LocalStore


def check_run_log(examined: Examined) -> Iterator[Finding]:
    """Compare the identity and the records of all shards with the log of the run."""
    stored = examined.stored
    store, plan = LocalStore(stored.folder), stored.plan
    path = store.run_dir / LOG_NAME
    if not path.is_file():
        yield not_checked("", f"there is no {RUN_NAME}/{LOG_NAME}")
        return
    # A run that was killed may leave half a line.
    entries = [entry for line in path.read_bytes().splitlines() if (entry := parse_object(line))]
    sealed = [identity for entry in entries if (identity := _identity(entry))]
    if not sealed:
        yield not_checked("", f"{RUN_NAME}/{LOG_NAME} has no record of the seal")
        return
    contradictions = Contradictions()
    committed = {e["shard"]: e["record_sha256"] for e in entries if e.get("record_sha256")}
    for shard in range(plan.shard_count):
        record = store.record_path(shard).read_bytes()
        if committed.get(shard, digest := hashlib.sha256(record).hexdigest()) != digest:
            samples = plan.samples_of(shard)
            contradictions.add(
                f"shard {shard}, samples {samples[0]} to {samples[-1]}: its record is not the one "
                "that was committed"
            )
    if sealed[-1] != stored.dataset_id:
        contradictions.add(
            f"the data set {stored.dataset_id[:16]} is not {sealed[-1][:16]}, which was sealed"
        )
    yield contradictions.judge("", {})


def _identity(entry: Mapping[str, Any]) -> str:
    """The identity of the finished data set in a line of the log; empty = none."""
    summary = entry.get("summary")
    return str(summary.get("dataset_id", "")) if isinstance(summary, Mapping) else ""
