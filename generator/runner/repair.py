"""Repair of everything but shards: the plan, and files that do not belong to the data set.

Damaged shards need nothing special: a run generates all shards that do not match their records.
"""

import hashlib
import os

from gen_data.core.errors import StorageError
from gen_data.runner import durable_files, layout, seal, verify
from gen_data.runner.plan import Plan, plan_bytes
from gen_data.runner.store import LocalStore


def read_declared_plan(store: LocalStore) -> bytes | None:
    """Bytes of the plan that a data set was started with: of ``plan.json``, or of its copy.

    Which of them is undamaged follows from ``SHA256SUMS``; without it, both must be equal.

    Returns:
        None if it is not known.
    """
    own = seal.read_or_empty(store.root / layout.PLAN_NAME)
    copy = seal.read_or_empty(store.run_dir / layout.PLAN_NAME)
    declared = seal.read_sums(store.root).digests.get(layout.PLAN_NAME)
    for data in (own, copy):
        if data and declared == hashlib.sha256(data).hexdigest():
            return data
    return own if own and own == copy else None


def restore_plan(store: LocalStore, plan: Plan) -> None:
    """Replace a damaged or missing ``plan.json`` by ``plan``, if the sums confirm it.

    Changes nothing if the folder is not a data set of this plan: the run then raises the error.

    Raises:
        StorageError: the file is damaged, and ``plan`` is another one.
    """
    path, data = store.root / layout.PLAN_NAME, plan_bytes(plan)
    current = seal.read_or_empty(path)
    sums = seal.read_sums(store.root)
    declared = {sums.digests.get(layout.PLAN_NAME)} - {None}
    if not declared:
        copy = seal.read_or_empty(store.run_dir / layout.PLAN_NAME)
        declared = {hashlib.sha256(copy).hexdigest()} if copy else set()
    started = os.path.lexists(path) or store.has_shards()
    if not started or not declared or hashlib.sha256(current).hexdigest() in declared:
        return
    if hashlib.sha256(data).hexdigest() not in declared:
        raise StorageError(
            f"{path}: damaged or missing, and the configuration and --n are not this data set's; "
            "nothing was changed. Repeat the command with the ones that it was made with"
        )
    with store.locked(), store.errors():
        if os.path.lexists(path):
            store.set_aside(path)
        durable_files.make_folder(store.scratch_root)
        durable_files.write_durably(path, data, store.scratch_root)


def quarantine_extra(store: LocalStore) -> None:
    """Move files and empty folders that do not belong to a finished data set to quarantine."""
    with store.errors():
        # More than once: a folder that held nothing else becomes empty.
        while extra := [f for f in verify.find_deviations(store.root) if f.kind == "extra"]:
            for finding in extra:
                store.set_aside(store.root / finding.path)
