"""``gen-data assets``: installable packs, the asset library, and the user's own folders."""

from __future__ import annotations

import json
import textwrap
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gen_data.cli import options
from gen_data.cli.tables import print_tables
from gen_data.core.errors import AssetError, ConfigError, did_you_mean

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from gen_data.assets.checking import Finding
    from gen_data.assets.library import Library
    from gen_data.core.asset_types import Asset

FOLDER = click.Path(path_type=Path, exists=True, file_okay=False)
TILE_PX = 256
_EVERY = "all"
_KINDS = ("object", "robot", "texture", "environment", "plate")


@click.group()
def assets() -> None:
    """Install, list, verify and remove asset packs; show the library; check your own folders."""


@assets.command()
@click.argument("names", nargs=-1, required=True, metavar="PACK...")
@click.option(
    "--from",
    "archive",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="Use this archive instead of fetching the package; for a single pack.",
)
@click.option("--again", is_flag=True, help="Reinstall packs that are already installed.")
def install(names: tuple[str, ...], archive: Path | None, again: bool) -> None:
    """Install packs, or `all`: fetch the pinned package, check its sha256, convert it."""
    from gen_data.assets.paths import packs_dir
    from gen_data.packs.install import install as install_pack
    from gen_data.packs.install import is_installed
    from gen_data.packs.pack_table import PACKS, find_pack

    packs = PACKS if _EVERY in names else tuple(find_pack(name) for name in names)
    if archive is not None and len(packs) != 1:
        raise ConfigError(f"--from takes the archive of one pack; {len(packs)} packs were given")
    folder = packs_dir()
    for pack in packs:
        if is_installed(pack, folder) and not again:
            click.echo(f"{pack.name}: {pack.source} is already installed")
            continue
        started_s = time.perf_counter()
        record = install_pack(pack, folder, archive)
        click.echo(
            f"{pack.name}: {pack.source}, {len(record.files)} files, {_format_mb(record.size)}, "
            f"{time.perf_counter() - started_s:.0f} s, licence {pack.licence}"
        )
        _warm_cache(pack.name)


@assets.command("list")
@click.argument("tags", nargs=-1)
@click.option("--folder", "folders", multiple=True, type=FOLDER, help="A folder of your assets.")
def list_(tags: tuple[str, ...], folders: tuple[Path, ...]) -> None:
    """List all packs; with TAGS or --folder, the assets that have all tags.

    A folder without tags lists its own assets.
    """
    if tags or folders:
        _list_assets(tags or ("user",), folders)
        return
    from gen_data.assets.installed_packs import installed_packs
    from gen_data.assets.paths import packs_dir
    from gen_data.config.describe import TEXT_WIDTH
    from gen_data.packs.install import is_installed
    from gen_data.packs.pack_table import PACKS

    folder = packs_dir()
    records = {record.name: record for record in installed_packs(folder)}
    for pack in PACKS:
        record = records.get(pack.name)
        state = "-"
        if record is not None:
            state = _format_mb(record.size) if is_installed(pack, folder) else "out of date"
        line = f"{pack.name:<10} {state:>12}  {pack.summary} ({pack.source}, {pack.licence})"
        click.echo(textwrap.fill(line, TEXT_WIDTH, subsequent_indent=" " * 25))
    click.echo(f"folder: {folder}")


@assets.command()
@click.argument("asset_id", metavar="ID")
@click.option("--folder", "folders", multiple=True, type=FOLDER, help="A folder of your assets.")
def show(asset_id: str, folders: tuple[Path, ...]) -> None:
    """Show an asset of the library: category, tags, licence, author, size."""
    from gen_data.packs.provision import open_assets

    library = open_assets(folders)
    asset = library.get(asset_id)
    for name, value in _describe_asset(asset).items():
        click.echo(f"{name:<12} {value}")
    if asset.kind != "object":
        return
    low, high = library.bounds_m(asset_id)
    size = " x ".join(f"{b - a:.3f}" for a, b in zip(low, high, strict=True))
    mesh = library.mesh(asset_id)
    click.echo(f"{'size_m':<12} {size}")
    click.echo(f"{'triangles':<12} {len(mesh.faces)}")
    roles = sorted({material.role for material in mesh.materials} - {""})
    click.echo(f"{'materials':<12} {len(mesh.materials)}, roles: {', '.join(roles) or 'none'}")
    points = ", ".join(point.name for point in library.keypoints(asset_id))
    click.echo(f"{'keypoints':<12} {points or 'none'}")
    shift_m = library.file_shift_m(asset_id)
    if shift_m is not None:
        shown = ", ".join(f"{value:.6g}" for value in shift_m)
        click.echo(f"{'shift_m':<12} {shown} (added to the file's coordinates, scaled and upright)")
    for remarks in library.remarks(asset_id) or ():
        for text in remarks.unused:
            click.echo(f"{'not used':<12} {remarks.file}: {text}")


@assets.command()
@click.argument("folder", type=FOLDER)
@click.option(
    "--sheet", type=click.Path(path_type=Path), help="Write pictures of all assets to this PNG."
)
@click.option(
    "--overlays",
    type=click.Path(path_type=Path),
    help="Write plates with their horizon and a grid of metres to this folder.",
)
def check(folder: Path, sheet: Path | None, overlays: Path | None) -> None:
    """Import every asset of your FOLDER; report its category, size, unit and faults."""
    from gen_data.assets.checking import check_folder
    from gen_data.assets.library import open_library

    library = open_library([folder])
    findings = tuple(check_folder(folder, library))
    if not findings:
        raise AssetError(
            f"{folder}: has no assets; expected OBJ, GLB, PLY, STL, DAE, USD, URDF, MJCF, SDF, HDR "
            "or EXR, or an assets.yaml that lists textures or plates"
        )
    _print_findings(findings)
    if sheet is not None:
        _write_thumbnails(library, tuple(f.asset_id for f in findings if not f.error), sheet)
    if overlays is not None:
        plates = [f.asset_id for f in findings if f.kind == "plate" and not f.error]
        _write_overlays(library, plates, overlays)
    unusable = [finding for finding in findings if finding.error]
    if unusable:
        raise AssetError(f"{folder}: {len(unusable)} of {len(findings)} assets cannot be used")
    count = "1 asset" if len(findings) == 1 else f"{len(findings)} assets, all"
    click.echo(f"{folder}: {count} can be used")


@assets.command()
@click.argument("folder", type=FOLDER)
@click.option("--out", "-o", type=click.Path(path_type=Path), help="[default: FOLDER.zip]")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def pack(folder: Path, out: Path | None, force: bool) -> None:
    """Write your FOLDER into one file, with equal bytes for equal content, for a recipe."""
    from gen_data.core.whole_files import check_new
    from gen_data.packs.own_pack import SUFFIX, write_pack
    from gen_data.runner.durable_files import storage_errors

    target = out or Path(f"{folder.resolve().name}{SUFFIX}")
    check_new([target], force=force)
    with storage_errors(target, ""):
        digest = write_pack(folder, target)
        click.echo(f"{target}: {_format_mb(target.stat().st_size)}, sha256 {digest}")


@assets.command()
@click.argument("source", metavar="CONFIG")
@options.configuration_options
def prepare(source: str, **changes: Unpack[options.Changes]) -> None:
    """Make everything that CONFIG can use ahead of its first run, and keep it in the cache.

    For images of containers and nodes of clusters, which take the folder of `gen-data cache info`
    along. Runs also make assets themselves, each when a scene first has it.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    from gen_data.api.prepare import prepare_assets

    started_s = time.perf_counter()
    columns = (BarColumn(20), MofNCompleteColumn(), TextColumn("{task.description}"))
    bar = Progress(*columns, console=Console(stderr=True))
    task = bar.add_task("")

    def show(asset_id: str, number: int, total: int) -> None:
        # Started by the first asset, because errors of the configuration come alone.
        bar.start()
        bar.update(task, completed=number, total=total, description=asset_id[:40])

    try:
        count = prepare_assets(source, on_progress=show, **changes)
        bar.update(task, completed=count, description="")
    finally:
        if bar.live.is_started:
            bar.stop()
    click.echo(f"{source}: {count} assets are ready, {time.perf_counter() - started_s:.0f} s")


@assets.command()
def schema() -> None:
    """Print the JSON Schema of assets.yaml, for completion in editors."""
    from gen_data.assets.folder_index import FolderIndex
    from gen_data.config.schema import json_schema

    described = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **json_schema(FolderIndex),
    }
    click.echo(json.dumps(described, indent=2, sort_keys=True))


@assets.command()
@click.argument("names", nargs=-1, metavar="[PACK]...")
def verify(names: tuple[str, ...]) -> None:
    """Compare installed packs (default: all) with their records by hashing every file."""
    from gen_data.assets.installed_packs import installed_packs
    from gen_data.assets.paths import packs_dir
    from gen_data.packs.install import verify as verify_pack

    folder = packs_dir()
    chosen = names or tuple(record.name for record in installed_packs(folder))
    for name in chosen:
        record = verify_pack(name, folder)
        click.echo(f"{name}: {len(record.files)} files as installed")


@assets.command()
@click.argument("names", nargs=-1, required=True, metavar="PACK...")
def remove(names: tuple[str, ...]) -> None:
    """Remove installed packs."""
    from gen_data.assets.paths import packs_dir
    from gen_data.packs.install import remove as remove_pack
    from gen_data.packs.pack_table import find_pack

    for name in names:
        remove_pack(find_pack(name).name, packs_dir())
        click.echo(f"{name}: removed")


def _warm_cache(pack: str) -> None:
    """Import a pack's objects into the cache: the first run then starts faster."""
    from gen_data.assets.library import open_library

    library = open_library()
    started_s = time.perf_counter()
    objects = [a.asset_id for a in library.find(()) if a.asset_id.startswith(f"{pack}/")]
    for robot in library.find((), "robot"):
        if robot.asset_id.startswith(f"{pack}/"):
            objects += library.robot(robot.asset_id).visuals.values()
    if not objects:
        return
    with click.progressbar(objects, label=f"{pack}: preparing {len(objects)} objects") as bar:
        for asset_id in bar:
            library.mesh(asset_id)
    click.echo(f"{pack}: prepared in {time.perf_counter() - started_s:.0f} s")


def _list_assets(tags: tuple[str, ...], folders: tuple[Path, ...]) -> None:
    from gen_data.packs.provision import open_assets

    library = open_assets(folders)
    found = [asset for kind in _KINDS for asset in library.find(tags, kind)]
    if not found:
        raise AssetError(_nothing_has(tags, library))
    for asset in found:
        click.echo(f"{asset.asset_id}  {asset.category}  [{' '.join(asset.tags)}]")


def _nothing_has(tags: tuple[str, ...], library: Library) -> str:
    """Why a list is empty: a tag that no asset has, with the nearest, or tags that never meet."""
    known = {tag for kind in _KINDS for asset in library.find((), kind) for tag in asset.tags}
    for tag in tags:
        if tag not in known:
            return f"no asset has the tag '{tag}'{did_you_mean(tag, known)}"
    return f"no asset has all of the tags {', '.join(tags)}; each of them has some"


def _print_findings(findings: Sequence[Finding]) -> None:
    """Print a table, followed by all errors, measurements and warnings, each on one line."""
    from rich.console import Console

    from gen_data.assets.checking import NO_LICENCE

    rows = [("id", "state", "kind", "category", "size [m]", "triangles", "unit", "up")]
    for one in findings:
        size = " x ".join(f"{edge:.3g}" for edge in one.size_m) if one.size_m else ""
        doubts = set(one.warnings) - {NO_LICENCE}
        state = "cannot be used" if one.error else "doubtful" if doubts else "ok"
        facts = (one.asset_id, state, one.kind, one.category, size, str(one.triangles or ""))
        rows.append((*facts, one.unit, one.up))
    # A sky has no triangles: columns without a value are left out.
    columns = (column for column in zip(*rows, strict=True) if any(column[1:]))
    header, *rows = zip(*columns, strict=True)
    print_tables(Console(), [{"title": "", "header": header, "rows": rows, "note": ""}])
    for one in findings:
        for problem in (one.error, one.note, *one.warnings):
            if problem and problem != NO_LICENCE:
                click.echo(f"{one.asset_id}: {problem}")
    unlicensed = sum(NO_LICENCE in one.warnings for one in findings)
    if unlicensed:
        click.echo(f"{unlicensed} of {len(findings)} assets: {NO_LICENCE}")


def _write_thumbnails(library: Library, asset_ids: Sequence[str], path: Path) -> None:
    from gen_data.preview.contact_sheet import Tile, arrange_tiles, render_tiles, write_sheet
    from gen_data.preview.thumbnails import thumbnail
    from gen_data.renderers.warp.renderer import WarpRenderer
    from gen_data.renderers.warp.settings import RenderSettings

    if not asset_ids:
        return
    renderer = WarpRenderer(library, "auto", RenderSettings())
    shown = (
        Tile(asset_id, thumbnail(library.get(asset_id), library, renderer, TILE_PX))
        for asset_id in asset_ids
    )
    write_sheet(arrange_tiles(render_tiles(shown, TILE_PX, captions=True), 0), path)
    click.echo(f"{path}: {len(asset_ids)} pictures")


def _write_overlays(library: Library, plates: Sequence[str], folder: Path) -> None:
    """Write every photograph with the geometry that is known of it, in full size."""
    from PIL import Image

    from gen_data.core.whole_files import whole_file
    from gen_data.preview.plate_overlay import plate_overlay

    for asset_id in plates:
        shown = plate_overlay(library.plate(asset_id), library.texture(asset_id).albedo)
        with whole_file(folder / f"{asset_id.replace('/', '_')}.png") as unfinished:
            Image.fromarray(shown).save(unfinished)
    click.echo(f"{folder}: {len(plates)} plates")


def _describe_asset(asset: Asset) -> dict[str, str]:
    facts = {
        "id": asset.asset_id,
        "kind": asset.kind,
        "category": asset.category,
        "subcategory": asset.subcategory,
        "attributes": ", ".join(f"{name}={value}" for name, value in asset.attributes),
        "tags": " ".join(asset.tags),
        "symmetries": ", ".join(
            f"{symmetry.fold or 'every angle'} about {symmetry.axis}"
            for symmetry in asset.symmetries
        ),
        "mass_kg": f"{asset.mass_kg:g}" if asset.mass_kg else "",
        "licence": asset.licence,
        "author": asset.author,
        "source": asset.source,
        "sha256": asset.sha256,
    }
    return {name: value for name, value in facts.items() if value}


def _format_mb(size: int) -> str:
    return f"{size / 1e6:.1f} MB"
