"""``gen-data cache``: size of the caches between runs, and their removal.

Nothing in a cache is needed: it is computed or fetched again. Staged shards of runs into object
storage lie next to the caches, but are results, and are never removed here.
"""

import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import click


@dataclass(frozen=True)
class Cache:
    """A part of the caches.

    Attributes:
        name: On the command line.
        content: In words.
        folders: Finds its folders; they need not exist.
    """

    name: str
    content: str
    folders: Callable[[], list[Path]]


def _asset_folders() -> list[Path]:
    from gen_data.assets.library import default_cache_dir
    from gen_data.packs.own_pack import own_packs_dir

    # Every version of the format; the files next to them are digests of users' files.
    found = [*default_cache_dir().glob("format-*"), *default_cache_dir().glob("*.json")]
    return found + [own_packs_dir()] * own_packs_dir().is_dir()


def _url_folders() -> list[Path]:
    from gen_data.runner.stored_objects import url_cache_dir

    return [url_cache_dir()]


def _sample_folders() -> list[Path]:
    from gen_data.runner.sample_cache import sample_cache_dir

    return [sample_cache_dir()]


def _kernel_folders() -> list[Path]:
    from gen_data.renderers.warp.device import kernel_folder

    return [kernel_folder()]


CACHES = (
    Cache("assets", "meshes, textures and shapes, ready for use", _asset_folders),
    Cache("urls", "files of data sets that were opened at a URL", _url_folders),
    Cache("samples", "samples of recipes that were opened", _sample_folders),
    Cache("kernels", "compiled kernels of the renderer", _kernel_folders),
)


@click.group()
def cache() -> None:
    """Show or clear the caches between runs: assets, files from URLs, samples, compiled kernels."""


@cache.command()
def info() -> None:
    """Show places and sizes."""
    from gen_data.runner.durable_files import format_bytes

    for one in CACHES:
        folders = one.folders()
        sizes = [size for folder in folders for size in _file_sizes(folder)]
        places = ", ".join(sorted({str(_place(folder)) for folder in folders})) or "empty"
        total = format_bytes(sum(sizes))
        click.echo(f"{one.name:8} {total:>10} {len(sizes):6} files  {one.content}\n  {places}")


@cache.command()
@click.argument("names", nargs=-1, type=click.Choice([one.name for one in CACHES]))
def clear(names: tuple[str, ...]) -> None:
    """Remove caches, or only those named; the next run is slower. Installed packs stay."""
    from gen_data.runner.durable_files import format_bytes

    for one in CACHES:
        if names and one.name not in names:
            continue
        before = after = 0
        for folder in one.folders():
            before += sum(_file_sizes(folder))
            _remove(folder)
            after += sum(_file_sizes(folder))
        kept = f"; {format_bytes(after)} are in use and stay" if after else ""
        click.echo(f"{one.name}: {format_bytes(before - after)} removed{kept}")


def _remove(path: Path) -> None:
    """Remove a folder or a file as far as no process prevents it, as Windows lets them."""
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        with suppress(OSError):
            path.unlink(missing_ok=True)


def _place(folder: Path) -> Path:
    is_part = folder.name.startswith("format-") or folder.name == "own-packs"
    return folder if folder.is_dir() and not is_part else folder.parent


def _file_sizes(folder: Path) -> list[int]:
    """Sizes of the files in a folder [bytes]; of a file its own; none if it does not exist."""
    from gen_data.runner.durable_files import tree_sizes

    if folder.is_file():
        return [folder.stat().st_size]
    return list(tree_sizes(folder).values())
