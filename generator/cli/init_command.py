"""``gen-data init`` and ``gen-data completion``: the first five minutes."""

import re
import shlex
import shutil
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gen_data.core.errors import ConfigError, StorageError, did_you_mean

if TYPE_CHECKING:
    from gen_data.cli.own_meshes import OwnMesh

ASSETS = "assets"
"""Folder of the user's meshes, next to the configuration."""

TAKE_MESHES = ("tabletop", "bin_picking", "shelf", "wrist_camera")
"""Shipped configurations that ``--mesh`` suits best."""


@click.command("init")
@click.option("--template", "-t", default="tabletop", help="Shipped configuration to start from.")
@click.option(
    "--mesh",
    "paths",
    multiple=True,
    type=click.Path(path_type=Path),
    help="Your own object (OBJ, GLB, glTF, PLY, STL, USD), or a folder of them. Repeatable.",
)
@click.option(
    "--class",
    "categories",
    multiple=True,
    help="Class name of all meshes, or of each in their order [default: names of their files].",
)
@click.option(
    "--out", "-o", type=click.Path(path_type=Path), default=Path(), help="Folder [default: here]."
)
def init(template: str, paths: tuple[Path, ...], categories: tuple[str, ...], out: Path) -> None:
    """Write a commented configuration and scene template to start from.

    With --mesh, the scenes hold your objects: their files are copied to assets/, with the materials
    and images that they refer to, and assets/assets.yaml shows the guessed units and axes.
    """
    from gen_data.cli.own_meshes import find_meshes, write_assets
    from gen_data.core.temporary_folders import temporary_folder

    if categories and not paths:
        raise ConfigError("--class: names the class of a mesh; expected --mesh with it")
    meshes = find_meshes(paths, categories)
    files = dict(starter_files(template, meshes))
    try:
        with temporary_folder("init") as folder:
            staging = folder / "files"
            (staging / ASSETS).mkdir(parents=True)
            for name, text in files.items():
                (staging / name).write_text(text, encoding="utf-8", newline="\n")
            if meshes:
                write_assets(meshes, staging / ASSETS)
            _move(staging, out)
    except OSError as error:
        place = error.filename2 or error.filename or out
        fact = f"{place}: {error.strerror}; choose another folder with --out"
        raise StorageError(fact) from error
    config = out / next(iter(files))
    written = [*files, *([f"{ASSETS}/"] if meshes else [])]
    click.echo(f"wrote {', '.join(str(out / name) for name in written)}")
    if meshes:
        _echo_remarks(out / ASSETS)
    click.echo("\nnext:")
    if meshes:
        _echo_command("assets", "check", out / ASSETS)
    _echo_command("contact-sheet", config, "--n", 6)
    _echo_command("--config", config, "--n", 100)


def _echo_remarks(folder: Path) -> None:
    from gen_data.assets.file_remarks import collect_remarks
    from gen_data.assets.folder_index import user_folder
    from gen_data.packs.provision import open_assets

    ids = [one.asset_id for one in user_folder(folder)]
    for remarks in collect_remarks(open_assets([folder]), ids):
        click.echo(f"{remarks.file}: not used as it is: {'; '.join(remarks.unused)}")


def _echo_command(*arguments: object) -> None:
    click.echo(f"    {shlex.join(['gen-data', *map(str, arguments)])}")


def _move(staging: Path, out: Path) -> None:
    """Copy all files; none replaces another, and after an error none is left."""
    files = sorted(path.relative_to(staging) for path in staging.rglob("*") if path.is_file())
    existing = [name for name in files if (out / name).exists()]
    if existing:
        raise ConfigError(f"{out / existing[0]}: exists already; choose another folder with --out")
    with ExitStack() as undo:
        for target in (out / name for name in files):
            for folder in reversed([p for p in target.parents if not p.exists()]):
                folder.mkdir()
                undo.callback(folder.rmdir)
            undo.callback(target.unlink, missing_ok=True)
            shutil.copyfile(staging / target.relative_to(out), target)
        undo.pop_all()


def starter_files(template: str, meshes: "Sequence[OwnMesh]") -> Iterator[tuple[str, str]]:
    """Names and texts of the files; the first one is the configuration.

    Raises:
        ConfigError: there is no such configuration, or its scenes take no objects.
    """
    from gen_data import configs, scene_templates
    from gen_data.assemble.config import load_config
    from gen_data.cli.own_meshes import own_objects

    folder = Path(configs.__path__[0])
    known = sorted(path.stem for path in folder.glob("*.yaml"))
    name = template.removesuffix(".yaml")
    if name not in known:
        raise ConfigError(
            f"--template {template}: unknown configuration; expected one of {', '.join(known)}"
            f"{did_you_mean(name, known)}"
        )
    config = load_config(name)
    scene = Path(scene_templates.__path__[0]) / f"{config.general.template}.yaml"
    text, scene_name = (folder / f"{name}.yaml").read_text("utf-8"), f"{name}_scene.yaml"
    # The first comment of a shipped file names its schema, which is not next to the copy.
    text = re.sub(r"\A# yaml-language-server.*\n", "", text)
    text, changed = re.subn(r"(?m)^template: \S+", f"template: {scene_name}", text)
    if not changed:
        text = f"{text.rstrip()}\ntemplate: {scene_name}\n"
    if meshes:
        groups = [e["name"] for e in config.resolved["elements"] if e["type"] == "objects"]
        others = f"expected --template {', '.join(TAKE_MESHES[:-1])} or {TAKE_MESHES[-1]}"
        if not groups:
            raise ConfigError(
                f"--mesh: the scenes of '{name}' take no objects of your own; {others}"
            )
        if taken := re.search(r"(?m)^(assets|elements|labels):", text):
            raise ConfigError(
                f"--mesh: '{name}' has its own '{taken[1]}', which init does not change; {others}; "
                f"or a configuration with 'extends: {name}' and your objects in "
                f"elements.{groups[0]}.assets and assets.folders"
            )
        text = f"{text.rstrip()}\n{own_objects(groups[0], meshes, config.resolved)}"
    yield f"{name}.yaml", text
    yield scene_name, scene.read_text("utf-8")


@click.command("completion")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> None:
    """Print the completion script of a shell: eval "$(gen-data completion bash)"."""
    from click.shell_completion import get_completion_class

    from gen_data.cli.main import cli

    kind = get_completion_class(shell)
    assert kind is not None, "the shells are click's own"
    click.echo(kind(cli, {}, "gen-data", "_GEN_DATA_COMPLETE").source())
