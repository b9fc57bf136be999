"""Recipes of data sets, and data sets made from them: behind ``gen-data recipe`` and ``pull``."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from gen_data.api import generate as generation
from gen_data.api.config import check_whole, load_config, path_text
from gen_data.core import errors, urls

if TYPE_CHECKING:
    from gen_data.assemble.config import Config
    from gen_data.assemble.pipeline_factory import PipelineFactory
    from gen_data.runner.plan import Plan
    from gen_data.runner.progress import RunProgress, Summary
    from gen_data.runner.ray_cluster import RayCluster
    from gen_data.runner.recipe import RecipeFile

IMAGE_LEVELS_MAX = 1.0
"""Largest mean absolute difference of two images that count as similar, in levels of 255."""


def recipe(
    source: str | PathLike[str],
    n: int | None = None,
    *,
    seed: int | None = None,
    overrides: Sequence[str] = (),
    without: Sequence[str] = (),
    packs: Sequence[str | PathLike[str]] = (),
) -> str:
    """The recipe of a data set: YAML of a few kilobytes, from which ``pull`` makes it again.

    Args:
        source: The folder of a finished data set; or a configuration, whose recipe names no
            digests of shards; or a recipe, which stays as it is.
        n: Number of samples; of a configuration only, like all that follow.
        seed: See ``generate``.
        overrides: See ``generate``.
        without: See ``generate``.
        packs: Files of ``gen-data assets pack`` with the author's folders of assets, whose names
            they have; of any source.

    Raises:
        ConfigError: the configuration or an argument is wrong, or the data set was re-rendered.
        VerificationError: the folder has no finished data set.
        StorageError: the data set is damaged.
    """
    from gen_data.runner.recipe import (
        describe_dataset,
        describe_plan,
        is_recipe,
        name_packs,
        read_recipe,
        recipe_text,
    )

    path = Path(path_text("source", source))
    try:
        is_kept, is_made = is_recipe(path), path.is_dir()
    except OSError:  # No file can have this name; load_config reports it.
        is_kept = is_made = False
    if is_kept or is_made:
        if n is not None or seed is not None or overrides or without:
            raise errors.ConfigError(
                f"{path}: states n, seed and all values itself; expected no others with it"
            )
        if is_made:
            return recipe_text(name_packs(describe_dataset(path), packs))
        file = read_recipe(path)
        return recipe_text(name_packs(file.values(), packs)) if packs else path.read_text("utf-8")
    if n is None:
        raise errors.ConfigError("--n is missing: how many samples has the data set?")
    check_whole("n", n, 1)
    loaded = load_config(source, seed=seed, overrides=overrides, without=without)
    from gen_data.runner.identity import format_licences, make_plan
    from gen_data.runner.licence_table import licences_in

    factory = generation.make_factory(loaded, n)
    plan = make_plan(factory)
    licences = licences_in(format_licences(factory, tuple(plan.assets)))
    return recipe_text(name_packs(describe_plan(plan, licences), packs))


def requirements(recipe_text: str) -> str:
    """Requirements file for pip, with the versions of the text of a recipe.

    Raises:
        ConfigError: the text holds no recipe.
    """
    from gen_data.config.yaml_tree import parse_yaml
    from gen_data.runner.recipe import check_recipe, requirements_text

    return requirements_text(check_recipe(parse_yaml(recipe_text, "<recipe>")))


def pull(  # noqa: PLR0913  (keywords of one front door)
    recipe: str | PathLike[str] | RecipeFile,
    *,
    out: str | PathLike[str] | None = None,
    workers: int | None = None,
    shards: tuple[int, int] | None = None,
    cluster: RayCluster | None = None,
    semantic: bool = False,
    against: str | PathLike[str] | None = None,
    trust: bool = False,
    on_progress: Callable[[RunProgress], None] | None = None,
    resume_command: str = "the same call of gen_data.pull",
) -> Summary:
    """Make the data set of a recipe, or the missing part of it, and prove that it is the same.

    Each shard is compared when it is finished, and the whole before it is sealed. A recipe of a
    configuration has nothing to compare with.

    Args:
        recipe: File with the recipe; the command has read it already.
        out: Folder or URL; None = ``out/<name in the recipe>``.
        workers: See ``generate``.
        shards: See ``generate``; ``merge`` gathers the parts.
        cluster: See ``generate``.
        semantic: Accept other versions, and compare labels only.
        against: Folder with the author's files: names sample and field of a difference; with
            ``semantic``, colour images must differ by at most ``IMAGE_LEVELS_MAX`` in the mean.
        trust: Read folders of assets outside of the recipe's own folder.
        on_progress: See ``generate``.
        resume_command: See ``generate``.

    Raises:
        ConfigError: the recipe or an argument is wrong; the message has the place.
        AssetError: packs or assets are missing or others, one line each; nothing was generated.
        DeterminismError: packages have other versions, one line each, and nothing was generated; or
            a shard or file came out differently, and nothing was sealed.
        VerificationError: with ``semantic``, labels or images differ.
        GenDataError: as ``generate``.

    Warns:
        ConfigWarning: with ``semantic``, the differences of this installation.
    """
    with generation.standby_worker(cluster, workers) as standby:
        file = _read(recipe, semantic)
        out = Path("out") / file.recipe.name if out is None else out
        if against is not None and urls.is_url(out):
            raise errors.ConfigError("against: compares folders; expected out without a URL")
        generation.check_arguments(file.path, file.recipe.n, out, workers, False)
        factory, plan = prepare(file, semantic, trust)
        settings = generation.make_settings(factory, bool(file.recipe.failed), None)
        settings = replace(
            settings,
            resume_command=resume_command,
            progress=on_progress,
            proof=file.recipe.proof(semantic),
        )
        choice = generation.RunChoice(out, workers, shards, cluster)
        try:
            summary = generation.run_factory(factory, settings, standby, choice, plan)
        except errors.DeterminismError as error:
            found = "" if against is None else _first_difference(plan, Path(against), Path(out))
            if not found:
                raise
            raise errors.DeterminismError(f"{error}\n  {found}") from None
    if not semantic:
        _check_identity(summary, file.recipe.dataset_id)
    elif against is not None:
        _compare_images(plan, Path(against), Path(out))
    return summary


def _read(recipe: str | PathLike[str] | RecipeFile, semantic: bool) -> RecipeFile:
    """Read a recipe. Raises ConfigError if it is wrong, or has no labels to compare."""
    from gen_data.runner.recipe import RecipeFile, read_recipe

    if not isinstance(recipe, RecipeFile):
        recipe = read_recipe(Path(path_text("recipe", recipe)))
    file = recipe
    if semantic and not file.recipe.labels:
        raise errors.ConfigError(
            f"{file.path}: names no digests of labels, which semantic compares; expected the "
            "recipe of a finished data set"
        )
    return file


def _check_identity(summary: Summary, expected: str) -> None:
    """Refuse a data set that was finished before, from the same plan with other exports."""
    if summary.dataset_id and expected and summary.dataset_id != expected:
        raise errors.DeterminismError(
            f"{summary.folder}: was finished before with other exports, id {summary.dataset_id}; "
            f"expected {expected}: choose another folder with --out"
        )


def prepare(file: RecipeFile, semantic: bool, trust: bool) -> tuple[PipelineFactory, Plan]:
    """Check that this installation can make the data set, before anything is generated.

    Raises:
        AssetError: packs or assets are missing or others, one line each.
        DeterminismError: packages have other versions, one line each.
        ConfigError: the configuration is not valid here.
    """
    from gen_data.runner.identity import make_plan

    versions, assets = list(_other_versions(file)), [*_other_packs(file, semantic)]
    places, folders = _find_folders(file, trust)
    assets += folders
    invalid: list[str] = []
    made: tuple[PipelineFactory, Plan] | None = None
    try:
        if not folders:
            loaded = file.config(places)
            own = list(_other_own_assets(file, loaded))
            assets += own
            if not own:
                factory = generation.make_factory(loaded, file.recipe.n)
                made = factory, make_plan(factory)
                _check_complete(file, made[1])
                assets += _other_assets(file, made[1], bool(versions or assets or semantic))
    except (errors.ConfigError, errors.AssetError) as error:
        if not versions and not assets:
            raise
        invalid.append(str(error))
    if semantic and versions:
        warnings.warn("\n".join(versions), errors.ConfigWarning, stacklevel=3)
        versions = []
    lines = [*versions, *assets, *invalid]
    if made is None or lines:
        kind = errors.AssetError if assets else errors.DeterminismError
        hint = "\n  --semantic accepts other versions, and compares labels only" if versions else ""
        lines.append(f"{len(lines)} difference(s); nothing was generated{hint}")
        raise kind("\n".join(lines))
    return made


def _other_versions(file: RecipeFile) -> Iterator[str]:
    from gen_data.runner.identity import release

    for name, wanted in file.recipe.versions.items():
        here = release(name)
        if here == wanted:
            continue
        remedy = f"pip install '{name}=={wanted}'"
        if wanted == "absent":
            remedy = f"pip uninstall {name}"
        elif name == "gen-data":
            remedy = f"install gen-data {wanted} from its repository"
        yield file.line(f"{wanted} made it, {here} is here; {remedy}", "versions", name)


def _other_packs(file: RecipeFile, semantic: bool) -> Iterator[str]:
    from gen_data.assets.installed_packs import installed_packs
    from gen_data.assets.paths import packs_dir

    here = {
        pack.name: f"{pack.version} {pack.digest[:16]}" for pack in installed_packs(packs_dir())
    }
    for name, wanted in file.recipe.assets.packs.items():
        fact = f"{wanted} made it, {here.get(name)} is here" if name in here else "is missing"
        if name not in here or (here[name] != wanted and not semantic):
            yield file.line(f"{fact}; gen-data assets install {name}", "assets", "packs", name)


def _find_folders(file: RecipeFile, trust: bool) -> tuple[dict[str, Path], list[str]]:
    """Folders of the packs that take the places of the author's, and lines on missing folders."""
    from gen_data.packs.own_pack import SUFFIX, unpacked
    from gen_data.runner.durable_files import storage_errors

    listed, stated = file.document.get("config", "assets", "folders"), file.recipe.assets
    base, lines = file.path.parent.resolve(), []
    places: dict[str, Path] = {}
    for number, name in enumerate(node.text for node in (listed.items if listed else ())):
        path = (base / name).resolve()
        is_outside = name.startswith("~") or not path.is_relative_to(base)
        digest, pack = stated.archives.get(name), base / f"{Path(name).name}{SUFFIX}"
        may_read = trust or not is_outside
        if may_read and (path.is_dir() or (is_outside and digest is None)):
            continue
        origin = stated.urls.get(name) or "the author"
        if digest is None and is_outside:
            fact = f"{name} is outside of {base}; --trust reads it"
        elif digest is None:
            fact = f"there is no folder {path}; get it from {origin}"
        else:
            try:
                with storage_errors(pack, ""):
                    places[name] = unpacked(pack, digest)
                continue
            except errors.AssetError as error:
                fact = f"{error}; get it from {origin}"
        lines.append(file.line(fact, "config", "assets", "folders", number))
    return places, lines


def _other_own_assets(file: RecipeFile, loaded: Config) -> Iterator[str]:
    """Lines on assets of the user's folders that are missing, changed or new."""
    from gen_data.packs.provision import open_assets

    own = file.recipe.assets.own
    if not own:
        return
    library, names = open_assets(loaded.asset_folders), ", ".join(loaded.asset_locations)
    for asset_id, wanted in own.items():
        try:
            here = library.get(asset_id).sha256
        except errors.UnknownAsset:
            yield file.line(
                f"is missing in {names}; get the file from the author", "assets", "own", asset_id
            )
            continue
        if here != wanted:
            fact = f"was changed in {names}: its digest is {here[:16]}, expected {wanted[:16]}"
            yield file.line(f"{fact}; get the author's file", "assets", "own", asset_id)


def _check_complete(file: RecipeFile, plan: Plan) -> None:
    """Refuse a configuration that names further files, or contradicts the recipe."""
    from gen_data.runner.plan import differences

    found = list(differences("config", file.recipe.config, plan.config))
    for name in ("n", "seed", "shard_size"):
        found += differences(name, getattr(file.recipe, name), getattr(plan, name))
    if found:
        raise errors.ConfigError(
            f"{file.path}: {found[0]}; expected a complete configuration, as gen-data recipe prints"
        )


def _other_assets(file: RecipeFile, plan: Plan, known: bool) -> Iterator[str]:
    """Lines on assets that are new, or others although their versions are equal."""
    from gen_data.runner.recipe import OWN, packs_of, shared_assets

    expected = file.recipe.assets
    for name in sorted(packs_of(plan).keys() - expected.packs.keys()):
        known = True
        yield file.line(f"lacks {name}; gen-data assets remove {name}", "assets", "packs")
    for asset_id in plan.assets:
        if asset_id.startswith(OWN) and asset_id not in expected.own:
            yield file.line(
                f"lacks {asset_id}, which is in the folder; move it away", "assets", "own"
            )
    here = shared_assets(plan.assets)
    if not known and here != expected.shared.model_dump():
        wanted = f"{expected.shared.count}, {expected.shared.sha256[:16]}"
        fact = f"{here['count']} assets, {here['sha256'][:16]}, are here; expected {wanted}"
        yield file.line(f"{fact}: install gen-data as the author had it", "assets", "shared")


def _first_difference(plan: Plan, against: Path, out: Path) -> str:
    """The first difference of the shards that two folders have, in words; empty if none."""
    from gen_data.runner.diff import compare
    from gen_data.runner.store import LocalStore

    one, other = LocalStore(against), LocalStore(out)
    for shard in range(plan.shard_count):
        records = one.record(shard), other.record(shard)
        if None not in records and records[0] != records[1]:
            found = compare(one.shard_dir(shard), other.shard_dir(shard))
            return str(found.sample or f"first file: {found.file}")
    return ""


def _compare_images(plan: Plan, against: Path, out: Path) -> None:
    """Refuse colour images that are not similar. Raises VerificationError."""
    import numpy as np

    from gen_data.core.capture import Channel
    from gen_data.runner.sample_stages import SampleFiles, read_array
    from gen_data.runner.store import LocalStore

    for shard in range(plan.shard_count):
        record = LocalStore(out).record(shard)
        failed = {failure.index for failure in record.failed} if record else set()
        folders = LocalStore(against).shard_dir(shard), LocalStore(out).shard_dir(shard)
        for index in plan.samples_of(shard) if record else ():
            media = {} if index in failed else SampleFiles(folders[1], index).media
            for name in (n for n, p in media.items() if p.parent.name == Channel.RGB.value):
                was, now = (read_array(folder / name).astype(np.float64) for folder in folders)
                same = was.shape == now.shape
                change = float(np.abs(was - now).mean()) if same else np.inf
                if change > IMAGE_LEVELS_MAX:
                    raise errors.VerificationError(
                        f"{folders[1] / name}: differs by {change:.2g} of 255 levels in the mean; "
                        f"expected at most {IMAGE_LEVELS_MAX:g}"
                    )
