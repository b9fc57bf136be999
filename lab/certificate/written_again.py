"""Claim: exports and documents follow from the samples, and nothing else is in the folder.

It also covers formats for which no official reader is known, and files that no reader looks at.
"""

import shutil
from collections.abc import Iterator

from gen_data.assemble.pipeline_factory import ready_exporters
from gen_data.lab.certificate.examined import Examined
from gen_data.lab.certificate.finding import Contradictions, Finding, not_checked
from gen_data.runner import durable_files, layout, seal
from gen_data.runner.exports import export
from gen_data.runner.run import Settings
from gen_data.runner.store import LocalStore


def check_written_again(examined: Examined) -> Iterator[Finding]:
    """Export the stored samples once more, and compare names and digests of all files.

    Images are linked, not copied; labels are written from the samples' labels.
    """
    if examined.changes:
        yield not_checked("", examined.changes)
        return
    stored, config = examined.stored, examined.config
    store = LocalStore(stored.folder)
    # On the same file system, for images to be linked.
    durable_files.make_folder(store.scratch_root)
    scratch = store.scratch_dir()
    try:
        exporters = ready_exporters(config, stored.info, examined.library)
        export(stored, config, exporters, scratch / "again", Settings())
        again = seal.read_sums(scratch / "again").digests
    finally:
        shutil.rmtree(scratch)
    found = seal.read_sums(stored.folder).digests
    contradictions = Contradictions()
    for path in sorted({*found, *again} - {layout.MANIFEST_NAME}):
        if path not in again:
            contradictions.add(f"{path}: is extra: the samples give no such file")
        elif path not in found:
            contradictions.add(f"{path}: is missing")
        elif found[path] != again[path]:
            contradictions.add(f"{path}: is not the one that the samples give")
    yield contradictions.judge("", {"files": len(again)})
