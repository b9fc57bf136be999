"""``gen-data init`` and ``gen-data completion``: the first five minutes."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import click

from gen_data.generator.core.errors import AssetError, ConfigError, did_you_mean

ASSETS = "assets"
"""Folder of the user's meshes, beside the configuration."""


@click.command("init")
@click.option("--template", "-t", default="tabletop", help="Shipped configuration to start from.")
@click.option(
    "--mesh", type=click.Path(path_type=Path), help="Your own object: OBJ, GLB, STL, PLY."
)
@click.option("--class", "category", default="", help="Its class name [default: its file's name].")
@click.option(
    "--out", "-o", type=click.Path(path_type=Path), default=Path(), help="Folder [default: here]."
)
def init(template: str, mesh: Path | None, category: str, out: Path) -> None:
    """Write a commented configuration and scene template to start from.

    With --mesh, the scenes hold your object: its file is copied to assets/, and assets/assets.yaml
    shows the guessed unit and axis.
    """
    files = dict(starter_files(template, mesh, category))
    existing = [name for name in files if (out / name).exists()]
    if existing:
        raise ConfigError(f"{out / existing[0]}: exists already; choose another folder with --out")
    for name, text in files.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text, encoding="utf-8", newline="\n")
    if mesh is not None:
        shutil.copyfile(mesh, out / ASSETS / mesh.name)
    config = out / next(iter(files))
    click.echo(f"wrote {', '.join(str(out / name) for name in files)}\n\nnext:")
    if mesh is not None:
        click.echo(f"    gen-data assets check {out / ASSETS}")
    click.echo(f"    gen-data contact-sheet {config} --n 6")
    click.echo(f"    gen-data --config {config} --n 100")


def starter_files(template: str, mesh: Path | None, category: str) -> Iterator[tuple[str, str]]:
    """Names and texts of the files; the first one is the configuration.

    Raises:
        ConfigError: there is no such configuration, or its scenes take no objects.
        AssetError: the mesh cannot be read.
    """
    from gen_data import configs, scene_templates
    from gen_data.generator.assemble.config import load_config

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
    # The first comment of a shipped file names its schema, which is not beside the copy.
    text = re.sub(r"\A# yaml-language-server.*\n", "", text)
    text, changed = re.subn(r"(?m)^template: \S+", f"template: {scene_name}", text)
    if not changed:
        text = f"{text.rstrip()}\ntemplate: {scene_name}\n"
    if mesh is None:
        yield f"{name}.yaml", text
    else:
        groups = [e["name"] for e in config.resolved["elements"] if e["type"] == "objects"]
        if not groups or re.search(r"(?m)^(assets|elements|labels):", text):
            raise ConfigError(
                f"--mesh: the scenes of '{name}' take no objects of your own; expected --template "
                "tabletop, bin_picking or shelf"
            )
        kind = category or mesh.stem
        yield f"{name}.yaml", f"{text.rstrip()}\n{_own_object(groups[0], mesh, kind)}"
        yield f"{ASSETS}/assets.yaml", _asset_index(mesh, kind)
    yield scene_name, scene.read_text("utf-8")


def _own_object(group: str, mesh: Path, category: str) -> str:
    return f"""
# Your object; assets/assets.yaml has its unit, axes and class.
assets: {{folders: [{ASSETS}]}}
elements:
  {group}: {{assets: {{ids: [user/{mesh.stem}]}}}}
labels:
  map: {{classes: {{{category}: }}}}     # exports have this class only; remove it for all
"""


def _asset_index(mesh: Path, category: str) -> str:
    """Index of the user's folder, with the unit and axis that the mesh suggests."""
    import numpy as np
    import trimesh

    if not mesh.is_file():
        raise AssetError(f"{mesh}: no such file; expected a mesh: OBJ, GLB, STL or PLY")
    try:
        bounds = trimesh.load_scene(mesh).bounds
    except Exception as error:
        raise AssetError(f"{mesh}: cannot be read as a mesh: {error}") from error
    if bounds is None:
        raise AssetError(f"{mesh}: holds no triangles")
    edges = np.ptp(bounds, axis=0)
    size = " x ".join(f"{edge:g}" for edge in edges)
    lines = [
        "licence: unknown                 # under which terms may it be used?",
        "assets:",
        f"  - file: {mesh.name}",
        f"    category: {category}",
    ]
    if mesh.suffix.lower() not in (".glb", ".gltf"):  # which are in metres, Y up
        unit = guess_unit(float(edges.max()))
        lines.append(f"    unit: {unit:<24}# a guess: its edges are {size} units")
        lines.append(
            "    up: z                        # a guess: the axis of the file that points up"
        )
    else:
        lines.append(f"    # glTF is in metres with Y up: its edges are {size} m")
    return "\n".join(lines) + "\n"


def guess_unit(longest: float) -> str:
    """Unit in which an object's longest edge is between 3 cm and 3 m, preferring metres."""
    for unit, metres in (("m", 1.0), ("mm", 0.001), ("cm", 0.01), ("in", 0.0254)):
        if 0.03 <= longest * metres <= 3.0:
            return unit
    return "m" if longest < 1.0 else "mm"


@click.command("completion")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> None:
    """Print the completion script of a shell: eval "$(gen-data completion bash)"."""
    from click.shell_completion import get_completion_class

    from gen_data.generator.cli.main import cli

    kind = get_completion_class(shell)
    assert kind is not None, "the shells are click's own"
    click.echo(kind(cli, {}, "gen-data", "_GEN_DATA_COMPLETE").source())
