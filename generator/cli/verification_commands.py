"""Commands that check and restore data sets: ``verify``, ``repair``, ``diff``, ``repro``."""

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gen_data.core.errors import ConfigError, DeterminismError, GenDataError, VerificationError
from gen_data.core.urls import is_url

if TYPE_CHECKING:
    from gen_data.runner.verify import Finding

_CHECK_CERTIFICATE = "gen_data.lab.certificate.verification:check_certificate"
"""Function of the laboratory, which stands above the command line."""

VERIFY_HELP = """Check a data set against its manifest. Exit code 7 if it deviates.

\b
gen-data verify DIR                  sizes, records, manifest, foreign files
gen-data verify DIR --full           every sha256
gen-data verify DIR --deep           every sample decoded, its labels checked;
                                     the claims of its certificate repeated
gen-data verify DIR --regenerate 20  20 random samples generated again
"""


@click.command(help=VERIFY_HELP)
@click.argument("place", metavar="FOLDER")
@click.option("--full", is_flag=True, help="Hash every file, not only sizes.")
@click.option("--deep", is_flag=True, help="Also decode every sample, and repeat a certificate.")
@click.option(
    "--regenerate",
    type=click.IntRange(min=1),
    metavar="K",
    help="Also generate K random samples again, and compare their bytes.",
)
@click.option(
    "--semantic",
    is_flag=True,
    help="With --regenerate: compare decoded contents, as after an update of an encoder.",
)
@click.option(
    "--source", type=click.Path(path_type=Path), help="With --regenerate, after rerender: source."
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def verify(
    place: str,
    full: bool,
    deep: bool,
    regenerate: int | None,
    semantic: bool,
    source: Path | None,
    as_json: bool,
) -> None:
    """Check a data set."""
    if not is_url(place):
        _verify(Path(place), full, deep, regenerate, semantic, source, as_json)
        return
    from gen_data.core.temporary_folders import temporary_folder
    from gen_data.runner.object_store import ObjectFolder, copy_outline

    objects = ObjectFolder(place.rstrip("/"))
    with temporary_folder("verify") as folder:
        if full or deep or regenerate is not None:
            objects.download({name: folder / name for name in objects.tree()})
        else:
            copy_outline(objects, folder)
        try:
            _verify(folder, full, deep, regenerate, semantic, source, as_json, place)
        except VerificationError as error:
            listed = str(error).partition("\n  Repair: ")[0].replace(str(folder), place)
            raise VerificationError(
                f"{listed}\n  The command that made the data set replaces damaged shards."
            ) from None


def _verify(
    folder: Path,
    full: bool,
    deep: bool,
    regenerate: int | None,
    semantic: bool,
    source: Path | None,
    as_json: bool,
    place: str = "",
) -> None:
    """Check a data set in a folder; ``place`` is its name in the result, empty = the folder."""
    place = place or str(folder)
    from gen_data.runner.deep_verify import choose_samples
    from gen_data.runner.verify import describe_findings, find_deviations, scan_finished, summarize

    if semantic and regenerate is None:
        raise ConfigError("--semantic: needs --regenerate K, whose comparison it changes")
    found: list[Finding] = []
    notes: list[str] = []
    try:
        contents = scan_finished(folder)
        report = summarize(folder, full or deep, contents)
        found = find_deviations(folder, full or deep, contents)
        # Damaged files would be reported once more by every further check.
        if not found and deep:
            found += _find_invalid(folder)
            notes.append("every sample decoded and valid")
        if not found:
            found += _check_certificate(folder, deep, notes)
        if not found and regenerate is not None:
            indices = choose_samples(folder, regenerate)
            found += _find_irreproducible(folder, indices, semantic, source)
            listed = ", ".join(map(str, indices[:10])) + (" ..." if len(indices) > 10 else "")
            what = "contents" if semantic else "bytes"
            notes.append(f"{len(indices)} samples generated again with equal {what} ({listed})")
        if found:
            raise VerificationError(describe_findings(folder, found))
    except GenDataError as error:
        if as_json:
            _print_json({"folder": place, "ok": False, "error": str(error)}, found)
        raise
    if as_json:
        facts = {
            name: getattr(report, name) for name in ("dataset_id", "samples", "files", "bytes")
        }
        _print_json({"folder": place, "ok": True, **facts, "checks": notes}, found)
    else:
        click.echo(f"{place}: {'; '.join([str(report), *notes])}")


def _find_invalid(folder: Path) -> "list[Finding]":
    from gen_data.runner.deep_verify import find_invalid_samples

    return list(find_invalid_samples(folder))


def _check_certificate(folder: Path, deep: bool, notes: list[str]) -> "list[Finding]":
    """Compare a certificate with the manifest, and with ``deep`` with one that is made now."""
    from gen_data.core.plugins import loaded
    from gen_data.runner.layout import CERTIFICATE_NAME
    from gen_data.runner.verify import Finding

    contradictions, compared = loaded(_CHECK_CERTIFICATE, "certificate")(folder, deep)
    notes += compared
    return [Finding("certificate", CERTIFICATE_NAME, text) for text in contradictions]


def _find_irreproducible(
    folder: Path, indices: list[int], semantic: bool, source: Path | None
) -> "list[Finding]":
    from threadpoolctl import threadpool_limits

    from gen_data.runner.deep_verify import find_irreproducible_samples

    with threadpool_limits(limits=1):
        return list(find_irreproducible_samples(folder, indices, semantic, source))


def _print_json(facts: dict[str, object], found: "list[Finding]") -> None:
    deviations = [
        {"kind": f.kind, "path": f.path, "samples": f.samples, "text": f.text} for f in found
    ]
    click.echo(json.dumps({**facts, "deviations": deviations}, ensure_ascii=False))


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "--source", type=click.Path(path_type=Path), help="After rerender: the data set it was made of."
)
@click.option("--workers", "-w", type=int, help="Worker processes [default: one per core].")
def repair(folder: Path, source: Path | None, workers: int | None) -> None:
    """Restore damaged or missing files of a data set, byte for byte, from its own plan.

    Damaged and foreign files are moved to FOLDER/run/quarantine.
    """
    from gen_data.api.repair import repair as restore
    from gen_data.cli.generate_command import print_summary, run_with_progress
    from gen_data.runner.layout import PLAN_NAME
    from gen_data.runner.plan import load_plan

    # A damaged plan is restored below; until then the number of samples is not known.
    try:
        n = load_plan(folder).n if (folder / PLAN_NAME).is_file() else 0
    except GenDataError:
        n = 0
    run = partial(restore, folder, source=source, workers=workers)
    print_summary(run_with_progress(n, run))


@click.command()
@click.argument("one", type=click.Path(path_type=Path, exists=True))
@click.argument("other", type=click.Path(path_type=Path, exists=True))
@click.option("--semantic", is_flag=True, help="Compare decoded contents, not bytes of files.")
def diff(one: Path, other: Path, semantic: bool) -> None:
    """Name the first difference of two data sets: sample, stage and field.

    Stages are scene, geometry, render, labels and encode. Two folders of one shard can be compared,
    too. Exit code 5 if there is a difference.
    """
    from gen_data.runner.diff import compare

    result = compare(one, other, semantic)
    for line in _listed(result.plan, 20):
        click.echo(f"plan: {line}")
    if result.sample is not None:
        raise DeterminismError(str(result.sample))
    if result.file:
        raise DeterminismError(f"all samples are equal; first difference of exports: {result.file}")
    click.echo(f"{result.samples} samples are equal, with all exported files")


@click.command()
@click.argument("source", metavar="FOLDER_OR_CONFIG")
@click.option("--index", "-i", type=int, required=True, help="Number of the sample, from 0.")
@click.option(
    "--out", "-o", type=click.Path(path_type=Path), help="Keep the sample in this new folder."
)
@click.option(
    "--source",
    "rerendered_from",
    type=click.Path(path_type=Path),
    help="After rerender: the data set it was made of.",
)
def repro(source: str, index: int, out: Path | None, rerendered_from: Path | None) -> None:
    """Generate one sample of a data set by itself, and compare it with the stored one.

    Prints a digest per stage. Exit code 5 if a stage differs, 6 if the sample cannot be generated.
    """
    from gen_data.api.reproduce import reproduce

    result = reproduce(source, index, out, rerendered_from=rerendered_from)
    for stage, digest in result.digests.items():
        click.echo(f"{stage:<9} {digest}")
    for line in _listed(result.changes, 20):
        click.echo(f"this installation differs: {line}", err=True)
    if result.difference is not None:
        raise DeterminismError(str(result.difference))
    if result.stored:
        click.echo(f"sample {index} is equal to the stored one")
    else:
        click.echo(f"sample {index} was generated; there is no stored one to compare it with")


def _listed(lines: tuple[str, ...], most: int) -> Iterator[str]:
    yield from lines[:most]
    if len(lines) > most:
        yield f"and {len(lines) - most} more"
