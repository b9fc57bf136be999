"""A study from input to page: perform or read runs, compare them, write the findings."""

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from gen_data.core.errors import StorageError
from gen_data.lab.study.evaluation import Evaluation, evaluate, read_results
from gen_data.lab.study.experiment import Experiment, perform, prepare, require_torch
from gen_data.lab.study.findings import Table, describe, tabulate
from gen_data.lab.study.page import format_page
from gen_data.lab.study.real_pictures import RealSet, check_judges, read_real

PAGE, FINDINGS = "study.html", "findings.json"


def run_study(
    experiment: Experiment,
    out: Path,
    *,
    workers: int | None = None,
    report: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Train all variants of an experiment, or the missing ones, and compare them.

    Args:
        experiment: Variants, real pictures and sizes.
        out: Folder of the experiment; an unfinished one in it is continued.
        workers: Processes; None = one per core.
        report: Called with a line on every step.

    Returns:
        The findings, as written to ``findings.json``.

    Raises:
        ConfigError: torch is not installed, or the input is wrong.
        StorageError: the folder holds another experiment, or cannot be written.
    """
    require_torch("study")
    tell = report or _ignore
    prepared = prepare(experiment)
    for line in _summary(prepared.real):
        tell(line)
    runs = perform(prepared, out, workers, tell)
    pictures = prepared.judged_pictures()
    evaluations: dict[str, list[Evaluation]] = {}
    for run in runs:
        found = evaluate(prepared.real, run.results(), pictures)
        evaluations.setdefault(run.variant.name, []).append(found)
    return write_findings(evaluations, prepared.real, out, f"Study on {prepared.real.source}")


def compare_results(
    folder: Path, files: Mapping[str, Path], out: Path, *, split: str = ""
) -> dict[str, Any]:
    """Compare COCO results of any detectors on the same real pictures; the first is the baseline.

    Raises:
        ConfigError: a file has no COCO results, or results of other pictures.
    """
    real = read_real(folder, split)
    check_judges(real)
    runs = {name: [evaluate(real, read_results(path, real))] for name, path in files.items()}
    return write_findings(runs, real, out, f"Study on {real.source}")


def write_findings(
    runs: Mapping[str, Sequence[Evaluation]], real: RealSet, out: Path, title: str
) -> dict[str, Any]:
    """Compare evaluations of variants, the first of which is the baseline; write the page.

    Raises:
        StorageError: the folder cannot be written.
    """
    findings = describe(runs)
    tables = [*tabulate(findings), _skipped(real)]
    findings |= {"source": str(real.source), "skipped": dict(real.skipped), "tables": tables}
    page = format_page(title, tables, runs)
    try:
        out.mkdir(parents=True, exist_ok=True)
        (out / PAGE).write_text(page, encoding="utf-8", newline="\n")
        text = json.dumps(findings, indent=1, ensure_ascii=False) + "\n"
        (out / FINDINGS).write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise StorageError(f"{out}: {error.strerror}; choose another folder") from error
    return findings


def _skipped(real: RealSet) -> Table:
    sizes = Counter(picture.size_px for picture in real.pictures)
    rows = [[f"pictures of {w} x {h}", str(count)] for (w, h), count in sizes.most_common(5)]
    if len(sizes) > 5:
        rows.append(["pictures of other sizes", str(sum(c for _, c in sizes.most_common()[5:]))])
    rows += [[f"remark: {reason}", str(count)] for reason, count in real.skipped.items()]
    return {"title": "read files", "header": ["", "count"], "rows": rows, "note": str(real.source)}


def _ignore(line: str) -> None:
    del line


def _summary(real: RealSet) -> list[str]:
    objects = sum(not thing.is_ignored for p in real.pictures for thing in p.objects)
    lines = [f"{real.source}: {len(real.pictures)} pictures, {objects} objects"]
    return lines + [f"  {count} x {reason}" for reason, count in real.skipped.items()]
