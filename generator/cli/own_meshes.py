"""Meshes of the user for ``gen-data init``: found, copied with the files they refer to, indexed."""

import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from gen_data.core.errors import AssetError, ConfigError

IN_METRES = (".glb", ".gltf")
"""Suffixes of formats whose unit is the metre and whose Y axis points up."""

STATES_UNIT = (".usd", ".usda", ".usdc", ".usdz")
"""Suffixes of formats whose files state unit and axis."""


@dataclass(frozen=True)
class OwnMesh:
    """A mesh file and the category of its objects.

    Attributes:
        root: Folder that has the mesh and all files that it refers to.
        file: Path of the mesh below it.
        folder: Folder below ``assets/`` for its files; empty = ``assets/`` itself.
    """

    root: Path
    file: str
    category: str
    folder: str = ""

    @property
    def place(self) -> str:
        """Path of the mesh below ``assets/``."""
        return str(PurePosixPath(self.folder, self.file))

    @property
    def asset_id(self) -> str:
        """Id of the asset."""
        from gen_data.assets.asset_folder import asset_id_from_path

        return f"user/{asset_id_from_path(self.place)}"

    def files(self) -> Iterator[tuple[Path, str]]:
        """The mesh and the files that it refers to, with their paths below ``assets/``."""
        from gen_data.assets.asset_folder import Folder
        from gen_data.assets.content_hashes import find_referenced_files

        for name in find_referenced_files(Folder(self.root), self.file):
            yield self.root / name, str(PurePosixPath(self.folder, name))


@dataclass
class _Taken:
    """Places below ``assets/`` that are in use: contents by path, and ids."""

    sources: dict[str, Path] = field(default_factory=dict)
    ids: set[str] = field(default_factory=set)

    def has_room(self, mesh: OwnMesh) -> bool:
        """Whether a mesh has a unique id, and no file of another content at its places."""
        return mesh.asset_id not in self.ids and all(
            place not in self.sources or self.sources[place].read_bytes() == source.read_bytes()
            for source, place in mesh.files()
        )

    def add(self, mesh: OwnMesh) -> None:
        """Take the places of a mesh."""
        self.ids.add(mesh.asset_id)
        self.sources |= {place: source for source, place in mesh.files()}


def find_meshes(paths: Sequence[Path], categories: Sequence[str]) -> tuple[OwnMesh, ...]:
    """Meshes of files and folders, each with a place below ``assets/``.

    Args:
        paths: Mesh files, or folders with meshes.
        categories: One for all meshes, or one for each; empty = the names of the files.

    Raises:
        AssetError: a file is missing or no mesh that can be read, or a folder has none.
        ConfigError: the number of categories fits neither.
    """
    found = [mesh for path in paths for mesh in _meshes_at(path)]
    if len(categories) not in (0, 1, len(found)):
        raise ConfigError(
            f"--class: {len(categories)} names for {len(found)} meshes; expected none, one for "
            "all, or one for each in their order"
        )
    names = [mesh.category for mesh in found]
    if categories:
        names = list(categories) * (len(found) if len(categories) == 1 else 1)
    taken, placed = _Taken(), []
    for mesh, name in zip(found, names, strict=True):
        stem = PurePosixPath(mesh.file).stem
        folders = ("", stem, *(f"{stem}_{k}" for k in range(2, len(found) + 2)))
        choices = (OwnMesh(mesh.root, mesh.file, name, folder) for folder in folders)
        chosen = next(choice for choice in choices if taken.has_room(choice))
        taken.add(chosen)
        placed.append(chosen)
    return tuple(placed)


def _meshes_at(path: Path) -> Iterator[OwnMesh]:
    from gen_data.assets.asset_folder import list_files
    from gen_data.assets.readers import MESH_SUFFIXES

    kinds = ", ".join(sorted(MESH_SUFFIXES))
    if not path.is_dir():
        if not path.is_file():
            raise AssetError(f"{path}: no such file; expected a mesh ({kinds}), or a folder")
        if path.suffix.lower() not in MESH_SUFFIXES:
            raise AssetError(f"{path}: is not a readable mesh; expected one of {kinds}")
        yield OwnMesh(path.parent, path.name, path.stem)
        return
    files = [name for name in list_files(path) if Path(name).suffix.lower() in MESH_SUFFIXES]
    if not files:
        raise AssetError(f"{path}: has no mesh; expected files of the types {kinds}")
    for name in files:
        yield OwnMesh(path, name, PurePosixPath(name).stem)


def write_assets(meshes: Sequence[OwnMesh], folder: Path) -> None:
    """Copy meshes with all files that they refer to, and write their index.

    Raises:
        AssetError: an asset cannot be used; the text names each of them.
    """
    from gen_data.assets.checking import check_folder
    from gen_data.packs.provision import open_assets

    for mesh in meshes:
        for source, place in mesh.files():
            (folder / place).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, folder / place)
    (folder / "assets.yaml").write_text(_index(meshes), encoding="utf-8", newline="\n")
    sources = {mesh.asset_id: mesh.root / mesh.file for mesh in meshes}
    faults = [
        f"{sources.get(one.asset_id, one.asset_id)}: {one.error.replace(f'{folder}/', '')}"
        for one in check_folder(folder, open_assets([folder]))
        if one.error
    ]
    if faults:
        raise AssetError("\n".join(faults))


def _index(meshes: Sequence[OwnMesh]) -> str:
    """Index of the user's folder, with the units and axes that the meshes suggest."""
    lines = ["licence: unknown                 # under which terms may they be used?", "assets:"]
    for mesh in meshes:
        lines += [f"  - file: {yaml_text(mesh.place)}", f"    category: {yaml_text(mesh.category)}"]
        lines += [f"    {line}" for line in _size_lines(mesh)]
    return "\n".join(lines) + "\n"


def _size_lines(mesh: OwnMesh) -> Iterator[str]:
    """Unit and axis of a mesh, or where they come from."""
    import numpy as np

    from gen_data.assets.asset_folder import Folder
    from gen_data.assets.readers import read_mesh

    suffix = PurePosixPath(mesh.file).suffix.lower()
    if suffix in STATES_UNIT:
        yield "# the file states its unit and the axis that points up"
        return
    points = read_mesh(Folder(mesh.root), mesh.file, materials=False).soup.corners
    edges = np.ptp(points.reshape(-1, 3), axis=0)
    size = " x ".join(f"{edge:g}" for edge in edges)
    if suffix in IN_METRES:
        yield f"# glTF is in metres with Y up: its edges are {size} m"
        return
    yield f"unit: {guess_unit(float(edges.max())):<24}# a guess: its edges are {size} units"
    yield "up: z                        # a guess: the axis of the file that points up"


def guess_unit(longest: float) -> str:
    """Unit in which an object's longest edge is between 3 cm and 3 m, preferring metres."""
    for unit, metres in (("m", 1.0), ("mm", 0.001), ("cm", 0.01), ("in", 0.0254)):
        if 0.03 <= longest * metres <= 3.0:
            return unit
    return "m" if longest < 1.0 else "mm"


def own_objects(group: str, meshes: Sequence[OwnMesh], resolved: Mapping[str, object]) -> str:
    """Sections of a configuration whose objects are the user's meshes.

    Args:
        group: Name of the group of objects.
        meshes: At least one.
        resolved: The configuration that they are added to.
    """
    ids = ", ".join(yaml_text(mesh.asset_id) for mesh in meshes)
    classes = dict.fromkeys(mesh.category for mesh in meshes)
    listed = "".join(f"      {yaml_text(name)}:\n" for name in classes)
    return f"""
# Your objects; assets/assets.yaml has their units, axes and classes.
{_how_to_leave_out(resolved)}assets: {{folders: [assets]}}
elements:
  {group}: {{assets: {{ids: [{ids}]}}}}
labels:
  map:
    classes:                       # exports have these classes only; remove the map for all
{listed}"""


def _how_to_leave_out(resolved: Mapping[str, object]) -> str:
    """Comments on the parts of the shipped scene that do not come from the user."""
    elements, randomizers = ([*_entries(resolved[key])] for key in ("elements", "randomizers"))
    text = ""
    for robot in (e["name"] for e in elements if e["type"] == "robot"):
        poses = [r["name"] for r in randomizers if str(r["type"]).startswith("arm_")]
        text += f"# Without the robot: delete the element '{robot}' of the template"
        text += "".join(f", and the randomizer '{name}' above" for name in poses) + ".\n"
    for name in (r["name"] for r in randomizers if r["type"] == "distractors"):
        text += f"# Without shapes that have no label: delete the randomizer '{name}' above.\n"
    return text


def _entries(listed: object) -> Iterator[Mapping[str, object]]:
    assert isinstance(listed, list), "lists of plug-ins of a resolved configuration"
    yield from listed


def yaml_text(text: str) -> str:
    """A text as a scalar of YAML, quoted if it must be."""
    import yaml

    first: str = yaml.safe_dump(text, allow_unicode=True, width=10_000).splitlines()[0]
    if first[0] in "'\"" or not set(first) & set(",[]{}"):
        return first
    # Plain scalars with these would end inside a flow list.
    return json.dumps(text, ensure_ascii=False)
