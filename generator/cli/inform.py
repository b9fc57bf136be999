"""Commands that tell: ``verify``, ``describe``, ``schema``, ``doctor``."""

from __future__ import annotations

import json
import platform
import shutil
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import click

from generator.core.errors import GenDataError, SampleError


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--full", is_flag=True, help="Hash every file, not only sizes.")
def verify(folder: Path, full: bool) -> None:
    """Check a data set against its manifest: sizes, or every sha256 with --full."""
    from generator.runner.verify import verify as check

    report = check(folder, full=full)
    click.echo(f"{folder}: {report}")


@click.command()
@click.argument("name", required=False)
def describe(name: str | None) -> None:
    """Explain a plug-in from its own fields; without NAME, list them all."""
    from generator.assemble.tables import TABLES, find_plugin
    from generator.config.describe import describe as text_of

    if name is None:
        for kind, table in TABLES.items():
            click.echo(f"{kind}: {', '.join(table)}")
        return
    kind, plugin = find_plugin(name)
    click.echo(f"{kind} {name}\n{text_of(plugin)}")


@click.command()
def schema() -> None:
    """Print the JSON Schema of configurations, for completion in editors."""
    from generator.assemble.schema import config_schema

    click.echo(json.dumps(config_schema(), indent=2, sort_keys=True))


@click.command()
def doctor() -> None:
    """Check this machine: versions, renderer, physics, cache folder, disk."""
    failures = [name for name, check in CHECKS if not _passes(name, check)]
    if failures:
        raise SampleError(f"doctor: {', '.join(failures)} failed; see above")


def _passes(name: str, check: Callable[[], str]) -> bool:
    started_s = time.perf_counter()
    try:
        found = check()
    except (GenDataError, ImportError, OSError) as error:
        click.echo(f"FAIL  {name:<10} {error}")
        return False
    click.echo(f"ok    {name:<10} {found} ({time.perf_counter() - started_s:.1f} s)")
    return True


def _versions() -> str:
    packages = ("gen-data", "warp-lang", "pybullet", "numpy", "opencv-python-headless")
    listed = ", ".join(f"{name} {version(name)}" for name in packages)
    return f"Python {platform.python_version()}, {listed}"


def _renders() -> str:
    """One small sample of the shipped tabletop, through every stage."""
    from generator.assemble.recipe import open_pipeline
    from generator.assemble.spec import load_config

    config = load_config("tabletop.yaml", overrides=("sensors[0].size_px=[160, 120]",))
    with open_pipeline(config) as pipeline:
        sample = pipeline.sample(0)
    labelled = sum(len(truth.objects) for truth in sample.truth.values())
    return f"one sample, {labelled} objects labelled, {sample.attempts} layout attempt(s)"


def _device() -> str:
    from generator.renderers.device import open_device

    return str(open_device("auto"))


def _cache() -> str:
    from generator.assets.library import default_cache_dir

    folder = default_cache_dir()
    folder.mkdir(parents=True, exist_ok=True)
    probe = folder / "doctor-probe"
    probe.write_bytes(b"ok")
    probe.unlink()
    return f"{folder}, {shutil.disk_usage(folder).free / 1e9:.1f} GB free"


def _open3d() -> str:
    try:
        import open3d
    except (ImportError, OSError) as error:
        # Only tests and point-cloud tools use it: a missing system library is no failure.
        return f"not loadable: {error}; apt-get install libusb-1.0-0 libgl1 libegl1 libgomp1"
    return str(open3d.__version__)


CHECKS: tuple[tuple[str, Callable[[], str]], ...] = (
    ("versions", _versions),
    ("device", _device),
    ("cache", _cache),
    ("pipeline", _renders),
    ("open3d", _open3d),
)
