"""Recipes: a data set as a few kilobytes of YAML, from which others make it again and prove it."""

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from gen_data.assemble.config import Config, config_of
from gen_data.config.base_model import Strict
from gen_data.config.problems import FieldPath, Position, Problems, format_path, refuse
from gen_data.config.validation import validate
from gen_data.config.yaml_scalars import json_as_yaml, to_flow_yaml
from gen_data.config.yaml_tree import Node, load_yaml
from gen_data.core import errors, path_names, serialization
from gen_data.runner import (
    durable_files,
    failed_sample,
    labels,
    layout,
    licence_table,
    plan,
    proof,
    seal,
    verify,
)

FORMAT = 1
SHARDS_MAX = 5_000
"""Of more shards no digests are listed: the file would be too long for its reader (1 MiB)."""
FILES_MAX = 32
"""Files outside of shards whose digests are listed."""
OWN = "user/"
"""Beginning of the ids of the user's assets."""
PACK = "pack "
"""Beginning of the names of packs in the versions of a plan."""

_PACKAGE = r"^[A-Za-z0-9]([A-Za-z0-9._-]{0,80}[A-Za-z0-9])?$"
_WIDTH = 100

Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Package = Annotated[str, Field(pattern=_PACKAGE)]
"""Names and versions become parts of commands that users copy."""
Version = Annotated[str, Field(pattern=r"^[A-Za-z0-9.!+_-]{1,80}$")]
Url = Annotated[str, Field(pattern=r"^(https?://[\w.~:/?#@!$&()*+,;=%-]+)?$")]
Name = Annotated[str, AfterValidator(path_names.check_name)]


class SharedAssets(Strict):
    """All assets but the user's, as one digest of their ids and digests."""

    count: int = Field(ge=0)
    sha256: Digest


class Assets(Strict):
    """Assets that a sample may contain.

    Attributes:
        shared: Assets of gen-data, pybullet and packs.
        packs: ``{name: "version digest"}`` of installed packs.
        own: ``{id: sha256}`` of the user's assets.
        urls: Where to get the user's folders, by their names in the configuration; empty = unknown.
        archives: SHA-256 of their packs, by the same names, if they travel as packs.
    """

    shared: SharedAssets
    packs: dict[Package, Annotated[str, Field(pattern=r"^\S+ [0-9a-f]{16}$")]]
    own: dict[str, Digest]
    urls: dict[str, Url]
    archives: dict[str, Digest] = Field(default_factory=dict)


class Recipe(Strict):
    """A data set and how to make it.

    Attributes:
        config: The resolved configuration, as in ``plan.json``.
        failed: Samples that the data set does not have.
        dataset_id, files, shards, labels: See ``proof.Proof``; empty if nothing was generated.
        licences: Names of the licences of its assets.
        checksums: See ``checksums_of``.
    """

    format: int
    name: Name
    n: int = Field(ge=1)
    seed: int = Field(ge=0)
    shard_size: int = Field(ge=1)
    dataset_id: str = Field("", pattern=r"^([0-9a-f]{64})?$")
    licences: tuple[str, ...]
    versions: dict[Package, Version]
    assets: Assets
    config: dict[str, Any]
    failed: tuple[int, ...] = ()
    files: dict[str, Digest] = Field(default_factory=dict)
    shards: tuple[Digest, ...] = ()
    labels: tuple[Digest, ...] = ()
    checksums: dict[str, Annotated[str, Field(pattern=r"^[0-9a-f]{16}$")]]

    def proof(self, semantic: bool) -> proof.Proof | None:
        """Digests that its data set must have; None if nothing was generated yet."""
        if not self.dataset_id:
            return None
        return proof.Proof(self.dataset_id, self.shards, self.labels, self.files, semantic)


COMMENTS = {
    "format": "A data set of gen-data. This makes it again, and proves that it is the same:\n"
    "#   gen-data pull recipe.yaml",
    "dataset_id": "SHA-256 of SHA256SUMS without the line of manifest.json.",
    "versions": "Everything that can change a byte.",
    "assets": "The author may add URLs of the folders to 'urls'.",
    "files": "SHA-256 of files outside of shards.",
    "shards": "SHA-256 of shards/000000.json and so on, which list the SHA-256 of all files.",
    "labels": "SHA-256 of labels.jsonl of each shard, which pull --semantic compares.",
    "checksums": "Beginnings of the SHA-256 of the values above: an edited one is named.",
}
"""Comments above keys of the file."""

NOT_GENERATED = (
    "# Nothing was generated yet: dataset_id, files, shards and labels are in the recipe of the\n"
    "# finished data set only.\n"
)


def describe_plan(made: plan.Plan, licences: Sequence[str]) -> dict[str, Any]:
    """Plain values of the recipe of a plan, in the order of the file."""
    folders = made.config.get("assets", {}).get("folders", ())
    versions = {k: v for k, v in made.versions.items() if not k.startswith(PACK)}
    values = {
        "format": FORMAT,
        "name": made.name,
        "n": made.n,
        "seed": made.seed,
        "shard_size": made.shard_size,
        "licences": list(licences),
        "versions": versions,
        "assets": {
            "shared": shared_assets(made.assets),
            "packs": packs_of(made),
            "own": {k: v for k, v in made.assets.items() if k.startswith(OWN)},
            "urls": dict.fromkeys(folders, ""),
        },
        "config": made.config,
    }
    # As plan.json has them: sorted, tuples as lists.
    plain: dict[str, Any] = json.loads(serialization.canonical_json(values))
    return {key: plain[key] for key in values}


def describe_dataset(folder: Path) -> dict[str, Any]:
    """Plain values of the recipe of a finished data set, in the order of the file.

    Raises:
        VerificationError: the folder has no finished data set.
        StorageError: it is damaged.
        ConfigError: it cannot be made from a recipe alone.
    """
    verify.scan_finished(folder)
    verify.check_source(folder)
    made = plan.load_plan(folder)
    if made.scenes_of or made.format_version != plan.FORMAT_VERSION:
        why = "has the scenes of another data set" if made.scenes_of else "is of an old format"
        raise errors.ConfigError(
            f"{folder}: {why}: its recipe would not give its bytes; expected a data set "
            "that this gen-data generated"
        )
    table = seal.read_or_empty(folder / layout.LICENCES_NAME).decode(errors="replace")
    values = describe_plan(made, licence_table.licences_in(table))
    sums = seal.read_sums(folder)
    manifest = seal.parse_object(seal.read_or_empty(folder / layout.MANIFEST_NAME)) or {}
    records = [f"{layout.SHARDS_NAME}/{shard:06d}" for shard in range(made.shard_count)]
    others = [path for path in sorted(sums.digests) if not path.startswith(layout.SHARDS_NAME)]
    named = [path for path in others if path in manifest["files"]][:FILES_MAX]
    found = {
        "failed": [failure.index for failure in failed_sample.parse_failed(manifest)],
        "files": {path: sums.digests[path] for path in named},
        "shards": [sums.digests[f"{record}.json"] for record in records],
        "labels": [sums.digests[f"{record}/{labels.LABELS_NAME}"] for record in records],
    }
    if len(records) > SHARDS_MAX:
        del found["shards"], found["labels"]
    if not found["failed"]:
        del found["failed"]
    head = {key: values[key] for key in ("format", "name", "n", "seed", "shard_size")}
    return {**head, "dataset_id": sums.dataset_id, **values, **found}


def recipe_text(values: Mapping[str, Any]) -> str:
    """The YAML file of a recipe; see ``describe_plan``."""
    parts = []
    for key, value in {**values, "checksums": checksums_of(values)}.items():
        comment = f"# {COMMENTS[key]}\n" if key in COMMENTS else ""
        if key == "checksums" and "dataset_id" not in values:
            parts.append(NOT_GENERATED)
        parts.append(comment + "".join(f"{line}\n" for line in yaml_lines({key: value})))
    return "".join(parts)


def name_packs(values: dict[str, Any], packs: Sequence[str | os.PathLike[str]]) -> dict[str, Any]:
    """Values of a recipe with the digests of packs of the user's folders.

    Raises:
        ConfigError: a pack has the name of none of the folders, or cannot be read.
    """
    folders = {Path(name).name: name for name in values["assets"]["urls"]}
    found = {}
    for pack in map(Path, packs):
        if pack.stem not in folders:
            raise errors.ConfigError(
                f"{pack}: has the name of no folder of the configuration; expected "
                f"{', '.join(f'{name}.zip' for name in folders) or 'none: it has no own assets'}"
            )
        try:
            found[folders[pack.stem]] = durable_files.hash_file(pack)
        except OSError as error:
            raise errors.ConfigError(f"{pack}: {error.strerror}; expected a pack") from None
    return {**values, "assets": {**values["assets"], "archives": found}} if found else values


def checksums_of(values: Mapping[str, Any]) -> dict[str, str]:
    """First 16 digits of the SHA-256 of the identity's values, as canonical JSON, by field."""
    head = {key: values[key] for key in ("name", "n", "seed", "shard_size")}
    config = {f"config.{key}": value for key, value in values["config"].items()}
    return {key: _digest(value)[:16] for key, value in {**head, **config}.items()}


def shared_assets(assets: Mapping[str, str]) -> dict[str, Any]:
    """Number and digest of all assets but the user's."""
    shared = {key: value for key, value in assets.items() if not key.startswith(OWN)}
    return {"count": len(shared), "sha256": _digest(shared)}


def packs_of(made: plan.Plan) -> dict[str, str]:
    """Versions of the packs in a plan, by their names."""
    return {k[len(PACK) :]: v for k, v in made.versions.items() if k.startswith(PACK)}


def _digest(value: Any) -> str:
    return hashlib.sha256(serialization.canonical_json(value).encode()).hexdigest()


def yaml_lines(value: Mapping[str, Any] | list[Any]) -> Iterator[str]:
    """Lines of YAML of a list or mapping, with short values on one line."""
    items = value.items() if isinstance(value, Mapping) else [(None, item) for item in value]
    for key, item in items:
        head = "-" if key is None else f"{to_flow_yaml(key)}:"
        line = f"{head} {_flow(item)}"
        is_short = len(line) <= _WIDTH - 8 and key not in ("versions", "config")
        if is_short or not isinstance(item, (Mapping, list)) or not item:
            yield line
        elif key is None:
            first, *rest = yaml_lines(item)
            yield f"- {first}"
            yield from (f"  {line}" for line in rest)
        else:
            yield head
            yield from (f"  {line}" for line in yaml_lines(item))


def _flow(value: Any) -> str:
    """A value on one line; numbers as in JSON, where 5 and 5.0 differ."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{to_flow_yaml(k)}: {_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return to_flow_yaml(value) if isinstance(value, str) else json_as_yaml(value)


@dataclass(frozen=True)
class RecipeFile:
    """A recipe that was read, with the places of its values."""

    path: Path
    document: Node
    recipe: Recipe

    def line(self, fact: str, *field: str | int) -> str:
        """One line on a field: its place, its name, and a fact."""
        return f"{_place(self.document, field)}: {format_path(field)}: {fact}"

    def values(self) -> dict[str, Any]:
        """Plain values in the order of the file; see ``recipe_text``."""
        plain: dict[str, Any] = self.document.plain()
        return {key: value for key, value in plain.items() if key != "checksums"}

    def config(self, places: Mapping[str, Path]) -> Config:
        """Its configuration.

        Args:
            places: Folders that replace asset folders in the recipe's folder, by their names.

        Raises:
            ConfigError: it is not valid here.
        """
        document = self.document.entries["config"]
        return config_of(document, self.recipe.name, asset_places=places)


def read_recipe(path: Path) -> RecipeFile:
    """Read a recipe.

    Raises:
        ConfigError: it is none, is cut off, was edited, or is of a newer format.
    """
    if path.name == layout.PLAN_NAME:
        # Paths in such a file would start from the current folder.
        raise errors.ConfigError(f"{path}: is the name of plans; expected a recipe")
    document = load_yaml(path)
    return RecipeFile(path, document, check_recipe(document))


def is_recipe(path: Path) -> bool:
    """Whether a YAML file has the format number of a recipe."""
    return path.is_file() and "format" in load_yaml(path).entries


def check_recipe(document: Node) -> Recipe:
    """The recipe in a document; see ``read_recipe``."""
    _check_format(document)
    problems = Problems()
    if "checksums" not in document.entries:
        last = list(document.entries)[-1]
        refuse(
            document.key_position(last),
            last,
            "the recipe ends here; expected 'checksums' as its last part: the file is cut off",
        )
    recipe = validate(document, Recipe, problems)
    problems.raise_if_any()
    assert recipe is not None
    _check_values(document, recipe, problems)
    problems.raise_if_any()
    return recipe


def _check_format(document: Node) -> None:
    found = document.get("format")
    if found is None:
        refuse(document.position, "format", "missing; expected a recipe, as gen-data recipe prints")
    if found.content == FORMAT and isinstance(found.content, int):
        return
    fact = f"{found.text} is not a format of recipes; expected {FORMAT}"
    if isinstance(found.content, int) and found.content > FORMAT:
        fact = f"{found.text} is newer than this gen-data; expected {FORMAT}: update gen-data"
    refuse(found.position, "format", fact)


def _check_values(document: Node, recipe: Recipe, problems: Problems) -> None:
    """Add a problem for each value that does not fit the others."""
    plain = recipe.model_dump()
    for field, checksum in checksums_of(plain).items():
        path = tuple(field.split(".", 1))
        stated = recipe.checksums.get(field)
        if stated is None:
            fact = f"lacks '{field}': the file is cut off, or was edited"
            problems.add(document.key_position("checksums"), "checksums", fact)
            return
        if stated != checksum:
            fact = f"was edited; expected the value with the checksum {stated}"
            problems.add(_place(document, path), path, fact)
    for field in recipe.checksums.keys() - checksums_of(plain).keys():
        fact = f"has '{field}', which the recipe lacks: it was edited"
        problems.add(_place(document, ("checksums", field)), "checksums", fact)
    count = -(-recipe.n // recipe.shard_size)
    for name in ("shards", "labels"):
        listed = len(plain[name])
        if listed != count and (listed or (recipe.dataset_id and count <= SHARDS_MAX)):
            fact = f"{listed} digests; expected {count}, one for each shard"
            problems.add(_place(document, (name,)), name, fact)
    config = document.entries["config"]
    elements = config.get("elements")
    for key in ("extends", "without"):
        if key in config.entries:
            fact = "the configuration of a recipe is complete; expected no other files"
            problems.add(config.key_position(key), f"config.{key}", fact)
    if elements is None or not isinstance(elements.content, tuple):
        fact = "expected a list of elements: the configuration of a recipe is complete"
        problems.add((elements or config).position, "config.elements", fact)


def _place(document: Node, path: FieldPath) -> Position:
    """Position of the key or item at the end of a path, or of the last part that exists."""
    for part in path[:-1]:
        document = document.get(part) or document
    last = path[-1]
    if isinstance(last, str):
        return document.key_position(last)
    return (document.get(last) or document).position


def requirements_text(recipe: Recipe) -> str:
    """Requirements file for pip, with the versions of a recipe."""
    packages = {k: v for k, v in recipe.versions.items() if k != "gen-data" and v != "absent"}
    head = (
        f"# Packages of the recipe of {json.dumps(recipe.name)}, made with gen-data "
        f"{recipe.versions.get('gen-data', '(unknown)')}, which comes from its repository.\n"
    )
    return head + "".join(f"{name}=={version}\n" for name, version in packages.items())
