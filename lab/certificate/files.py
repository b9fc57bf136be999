"""Claim: the files are the manifest's files."""

import os
from collections.abc import Iterator

from gen_data.lab.certificate.examined import Examined
from gen_data.lab.certificate.finding import Contradictions, Finding
from gen_data.runner.verify import find_deviations, summarize


def check_files(examined: Examined) -> Iterator[Finding]:
    """Hash every file and compare it with the manifest."""
    folder = examined.stored.folder
    # A folder that cannot be read is not empty.
    for _ in os.walk(folder, onerror=_raise):
        pass
    contradictions = Contradictions()
    for deviation in find_deviations(folder, full=True):
        contradictions.add(str(deviation))
    report = summarize(folder, full=True)
    yield contradictions.judge("", {"files": report.files, "bytes": report.bytes})


def _raise(error: OSError) -> None:
    raise error
