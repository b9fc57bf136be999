"""Configurations: read, merged with their templates, and validated."""

import json
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, TypedDict, TypeVar, cast

from pydantic import Field
from typing_extensions import Unpack

from gen_data.annotations.annotate import Thresholds
from gen_data.assemble import documents
from gen_data.assemble.plugin_tables import (
    ANNOTATIONS,
    ELEMENTS,
    EXPORTERS,
    RANDOMIZERS,
    RENDERERS,
    SENSORS,
    find_other_list,
)
from gen_data.config import merging, shared_values
from gen_data.config.base_model import Strict
from gen_data.config.paths import PLAN, find_path
from gen_data.config.problems import Problems
from gen_data.config.validation import validate
from gen_data.config.yaml_scalars import json_as_yaml, quote_value
from gen_data.config.yaml_tree import Node
from gen_data.core import bounded_cache, errors, interfaces, scene
from gen_data.core.plugins import PluginTable
from gen_data.core.streams import Streams
from gen_data.exporters.label_map import LabelMap, in_order
from gen_data.physics import PhysicsConfig
from gen_data.pipeline.splits import Splits

SHARD_SIZE = 20
"""Small: a crash loses few samples, and all workers stay busy."""

DEFAULT_RENDERER = "warp"

P = TypeVar("P")


RUN_KEYS = frozenset({"skip_failed", "sample_timeout_s"})
"""Keys that a plan leaves out: options of a run, like options of the command line."""


class AssetFolders(Strict):
    """Assets of the user."""

    folders: tuple[str, ...] = Field((), description="Folders of OBJ, GLB, PLY, STL or URDF files.")


class DatasetSettings(Strict):
    """Publication of the data set: in its card, ``croissant.json`` and the exporter ``croissant``.

    Attributes:
        title: Name for readers; empty = the name of the configuration.
        description: Its content and purpose in a few sentences.
        license: An SPDX identifier such as ``CC-BY-4.0``, or a URL; empty = only the licences of
            its assets are stated.
        creators: Names of persons or organisations.
        url: Its web page.
        date_published: Date of publication, such as ``2026-11-22``.
        cite_as: Citation, such as a BibTeX entry.
        version: Version of the data.
    """

    title: str = ""
    description: str = ""
    license: str = ""
    creators: tuple[str, ...] = ()
    url: str = Field("", pattern=r"^(https?://\S+)?$")
    date_published: str = Field("", pattern=r"^(\d{4}-\d{2}-\d{2})?$")
    cite_as: str = ""
    version: str = Field("1.0.0", pattern=r"^\d+\.\d+\.\d+$")


class LabelSettings(Thresholds):
    """Thresholds for annotating an instance, extent of boxes, and the label map of all exports."""

    box3d: scene.Box3dExtent = Field(
        "body",
        description="3D boxes of vehicles: body, without exterior mirrors, as annotators draw "
        "them; all of the geometry; or annotated, the body, and people with room for their whole "
        "stride and 5 cm on each side and above, as in tracks of KITTI and nuScenes.",
    )
    map: LabelMap = LabelMap()


class GeneralSettings(Strict):
    """Settings of a configuration, without its plug-ins."""

    seed: int = Field(0, ge=0, lt=2**63, description="Seed of the data set; 0 is a seed.")
    views_per_scene: int = Field(
        1, ge=1, le=10_000, description="Views that share one settled scene."
    )
    steps_per_scene: int = Field(
        1, ge=1, le=10_000, description="Instants of every view: samples that follow in time."
    )
    step_s: float = Field(0.1, gt=0, le=10, description="Time between two instants [s].")
    twins: bool = Field(
        False,
        description="Every view twice: with a demonstration of an arm that fails, and with the one "
        "that recovers; everything else is the same.",
    )
    shard_size: int = Field(
        SHARD_SIZE, ge=1, le=100_000, description="Samples that are committed together."
    )
    skip_failed: bool = Field(
        False, description="Go on without samples that cannot be made, as --skip-failed."
    )
    sample_timeout_s: float | None = Field(
        None,
        gt=0,
        le=1e6,
        description="Time after which a sample counts as hung [s], as --sample-timeout.",
    )
    depth_scale_m: float = Field(
        0.0001, gt=0, le=1, description="Metres per unit of 16-bit depth images."
    )
    template: str = Field("", description="Name of a scene template.")
    physics: PhysicsConfig = Field(default_factory=PhysicsConfig)
    labels: LabelSettings = LabelSettings()
    splits: Splits = Splits()
    assets: AssetFolders = AssetFolders()
    dataset: DatasetSettings = DatasetSettings()

    @property
    def samples_per_scene(self) -> int:
        """Samples of a scene: of all its views, with twins, and all their steps."""
        return (2 if self.twins else 1) * self.views_per_scene * self.steps_per_scene


@dataclass(frozen=True)
class SceneConfig:
    """Configuration of one scene, with its shared values filled in.

    Attributes:
        shared: Names and values of shared values, sorted by name.
    """

    shared: tuple[tuple[str, scene.SharedValue], ...]
    elements: tuple[interfaces.Element, ...]
    randomizers: tuple[interfaces.Randomizer, ...]
    sensors: tuple[interfaces.Sensor, ...]


VARYING: Mapping[str, PluginTable[Any]] = {
    "elements": ELEMENTS,
    "randomizers": RANDOMIZERS,
    "sensors": SENSORS,
}
"""Lists that may depend on shared values, with their plug-in tables."""

PLUGIN_LISTS: Mapping[str, PluginTable[Any]] = {**VARYING, "exporters": EXPORTERS}
"""Lists of plug-ins with a ``type``, with their tables."""

CONSTANT = {
    "elements": ("type", "name"),
    "randomizers": ("type", "name"),
    "sensors": (
        "type", "name", "model", "size_px", "channels", "stereo_with", "rate_hz", "rotation_hz",
        "time_offset_s", "lens.model",
    ),
}  # fmt: skip
"""Fields that must not depend on shared values, by list.

They are properties of the whole data set, such as the size of its images.
"""


@dataclass(frozen=True)
class Config:
    """A validated configuration; picklable.

    Attributes:
        name: Name of the configuration, and of the default output folder.
        resolved: The merged document as plain data, as in ``plan.json``; it gives the same Config.
        render: Settings of the renderer.
        exporters: Plug-ins, in order.
        annotations: Annotators by name, in order.
        probes: Configurations of scenes that cover the shared values; one if there are none.
        document: The merged document, the source of configurations of scenes.
        asset_places: Folders that replace the user's, by their names.
    """

    name: str
    resolved: Mapping[str, Any]
    general: GeneralSettings
    render: interfaces.RendererSettings
    annotations: Mapping[str, interfaces.AnyAnnotator]
    exporters: tuple[interfaces.Exporter, ...]
    probes: tuple[SceneConfig, ...]
    document: Node = field(compare=False)
    asset_places: Mapping[str, Path] = field(default_factory=dict, compare=False)

    @property
    def sensors(self) -> tuple[interfaces.Sensor, ...]:
        """Sensors of the first scene; sensors of other scenes differ in parameters only."""
        return self.probes[0].sensors

    def plugins(self) -> Iterator[object]:
        """Yield all plug-ins of the configuration."""
        yield self.render
        yield from (*self.annotations.values(), *self.exporters)
        for config in self.probes:
            yield from (*config.elements, *config.randomizers, *config.sensors)

    def shared(self, streams: Streams) -> tuple[tuple[str, scene.SharedValue], ...]:
        """Draw the shared values of one scene, sorted by name."""
        section = self.document.entries["shared"]
        return (
            tuple(sorted(shared_values.draw_shared(section, streams).items()))
            if section.content
            else ()
        )

    def scene_config(self, shared: tuple[tuple[str, scene.SharedValue], ...]) -> SceneConfig:
        """Make the configuration of a scene with these shared values.

        Raises:
            ConfigError: the shared values make a plug-in invalid.
        """
        if not shared:
            return self.probes[0]
        problems = Problems()
        known = _CONSTANT_PARTS.get(self.document, self._constant_parts).copy()
        config = _scene_config(self.document, dict(shared), problems, known)
        problems.raise_if_any()
        return config

    def _constant_parts(self) -> "_Known":
        """Parts of scenes that do not depend on shared values."""
        known = _Known()
        _scene_config(self.document, dict(self.probes[0].shared), Problems(), known)
        return known.constant()

    @property
    def asset_folders(self) -> tuple[Path, ...]:
        """Folders of the user's assets. Raises ConfigError if a folder does not exist."""
        listed = self.document.get("assets", "folders")
        return tuple(
            self.asset_places.get(node.text)
            or find_path(node.text, node.position, f"assets.folders[{k}]", "folder", is_folder=True)
            for k, node in enumerate(listed.items if listed else ())
        )

    @property
    def asset_locations(self) -> dict[str, Path]:
        """Folders of the user's assets by their names in the configuration."""
        listed = self.document.get("assets", "folders")
        names = [node.text for node in listed.items] if listed else []
        return dict(zip(names, self.asset_folders, strict=True))

    @property
    def split_shares(self) -> dict[str, float]:
        """Shares of the splits that are above 0, in order."""
        return self.general.splits.shares


class Changes(TypedDict, total=False):
    """Changes of the command line to a configuration.

    Attributes:
        seed: Seed of the data set; None = the configuration's.
        overrides: ``KEY=VALUE`` each.
        without: Names of randomizers to leave out.
        first_scene_only: Check the first scene instead of all outcomes of shared values: for a
            data set whose scenes exist.
        asset_places: See ``Config``.
    """

    seed: int | None
    overrides: Sequence[str]
    without: Sequence[str]
    first_scene_only: bool
    asset_places: Mapping[str, Path]


def load_config(source: str, **changes: Unpack[Changes]) -> Config:
    """Load a configuration by path or shipped name; the folder of a data set stands for its own.

    Raises:
        ConfigError: the message lists all errors with their positions.
    """
    plan = Path(source) / PLAN
    if not _is_file(plan):
        return config_of(documents.load_config_document(source), Path(source).stem, **changes)
    try:
        kept = json.loads(plan.read_bytes())
        text, name = json_as_yaml(kept["config"]), str(kept["name"])
    except (ValueError, KeyError, TypeError, OSError) as error:
        raise errors.ConfigError(f"{plan}: is not the plan of a data set: {error}") from error
    return parse_config(text, str(plan), name, **changes)


def _is_file(path: Path) -> bool:
    """Whether a path is a file; False for names that no file can have."""
    try:
        return path.is_file()
    except OSError:
        return False


def parse_config(text: str, file: str, name: str, **changes: Unpack[Changes]) -> Config:
    """Parse a configuration in a YAML text; messages call the text ``file``.

    Raises:
        ConfigError: the message lists all errors with their positions.
    """
    return config_of(documents.parse_config_document(text, file), name, **changes)


def config_of(document: Node, name: str, **changes: Unpack[Changes]) -> Config:
    """The configuration in a document that extends no other one.

    Raises:
        ConfigError: the message lists all errors with their positions.
    """
    seed = changes.get("seed")
    if seed is not None and seed < 0:
        raise errors.ConfigError(f"--seed: {seed} is negative; expected 0 or more")
    overrides, without = changes.get("overrides", ()), changes.get("without", ())
    document = documents.resolve_document(document, seed=seed, overrides=overrides, without=without)
    sections, problems = document.entries, Problems()
    apart = {*PLUGIN_LISTS, "annotations", "shared", "render"}
    general = {key: node for key, node in sections.items() if key not in apart}
    head = validate(replace(document, content=general), GeneralSettings, problems)
    for key, node in sections.items():
        if key not in ("shared", *VARYING) and shared_values.refers(node):
            fact = f"cannot depend on shared values; expected them in {', '.join(VARYING)} only"
            problems.add(node.position, (key,), fact)
    render = _plugin(sections["render"], "render", RENDERERS, problems, DEFAULT_RENDERER)
    exporters = _plugins(sections["exporters"], "exporters", EXPORTERS, problems, _Known())
    annotations = _annotations(sections["annotations"], problems)
    if not sections["sensors"].content and not len(problems):
        problems.add(document.position, "sensors", "at least one sensor is needed")
    for key, names in CONSTANT.items():
        _refuse_varying(sections[key], key, names)
    scenes = 1 if changes.get("first_scene_only") else None
    probes = _probe(document, head.seed if head else 0, problems, scenes)
    problems.raise_if_any()
    assert head is not None
    assert render is not None
    config = Config(
        name, in_order(document.plain()), head, render, annotations, exporters, probes, document,
        changes.get("asset_places", {}),
    )  # fmt: skip
    _ = config.asset_folders  # Missing folders are refused before a run.
    return config


def _refuse_varying(listed: Node, key: str, names: tuple[str, ...]) -> None:
    """Raise ConfigError if a field of the whole data set depends on shared values."""
    fact = "is the same in all scenes of a data set; "
    fact += "expected a value that does not depend on shared ones"
    problems = Problems()
    for number, item in enumerate(listed.items):
        for name in names:
            place = shared_values.varying_place(item, name)
            if place == item.position:
                problems.add(place, f"{key}[{number}]", fact)
            elif place is not None:
                problems.add(place, f"{key}[{number}].{name}", fact)
    problems.raise_if_any()


def _probe(
    document: Node, seed: int, problems: Problems, scenes: int | None
) -> tuple[SceneConfig, ...]:
    """Distinct configurations of the first probe values (None = all); stops at errors."""
    section = document.entries["shared"]
    every = (
        list(islice(shared_values.probe_values(section, seed), scenes)) if section.content else [{}]
    )
    configs: list[SceneConfig] = []
    known = _Known()
    for shared in every:
        found = Problems()
        config = _scene_config(document, shared, found, known)
        if len(found):
            problems.extend(found)
            break
        if config not in configs:
            configs.append(config)
    return tuple(configs)


@dataclass(frozen=True)
class _Known:
    """Parts of scenes of one document that were made before: most are the same in most scenes.

    Attributes:
        names: Names of the shared values that an item depends on, by its ``id()``.
        items: Resolved items, by the ``id()`` of the document's own and the values of these names.
        plugins: Plug-ins and their resolved items, by the list and the item's ``id()``.
    """

    names: dict[int, list[str]] = field(default_factory=dict)
    items: dict[tuple[int, str], Node] = field(default_factory=dict)
    plugins: dict[tuple[str, int], tuple[Node, Any]] = field(default_factory=dict)

    def constant(self) -> "_Known":
        """Names of all items, and those parts that are the same in all scenes."""
        items = {place: node for place, node in self.items.items() if not self.names[place[0]]}
        kept = {id(node) for node in items.values()}
        plugins = {place: known for place, known in self.plugins.items() if place[1] in kept}
        return _Known(self.names, items, plugins)

    def copy(self) -> "_Known":
        """A copy that may grow by the parts of one scene."""
        return _Known(dict(self.names), dict(self.items), dict(self.plugins))

    def resolve(self, listed: Node, shared: Mapping[str, scene.SharedValue], key: str) -> Node:
        """Replace the shared values in a list of the document.

        Raises:
            ConfigError: a name is unknown, or a ``switch`` has no entry for its value.
        """
        if shared_values.is_reference(listed):
            return shared_values.resolve_shared(listed, shared, key)

        def resolve_item(number: str | int, item: Node) -> Node:
            if id(item) not in self.names:
                self.names[id(item)] = _NAMES.get(
                    item, lambda: sorted(shared_values.names_in(item))
                )
            # As text: 1, 1.0 and true are equal, but not the same value.
            place = id(item), repr([shared.get(name) for name in self.names[id(item)]])
            if place not in self.items:
                self.items[place] = shared_values.resolve_shared(item, shared, key, number)
            return self.items[place]

        return listed.with_children(resolve_item)

    def plugin(self, key: str, node: Node, make: Callable[[], P | None]) -> P | None:
        """The plug-in of an item; None if it has errors."""
        source, plugin = self.plugins.get((key, id(node)), (None, None))
        if source is not node:
            plugin = make()
            if plugin is not None:
                self.plugins[key, id(node)] = node, plugin
        return plugin


_NAMES: bounded_cache.ObjectCache[list[str]] = bounded_cache.ObjectCache(512)
"""Names of the shared values that the latest items depend on: inherited ones are met again."""
_CONSTANT_PARTS: bounded_cache.ObjectCache[_Known] = bounded_cache.ObjectCache(4)
"""Parts of the latest documents that do not depend on shared values."""


def _scene_config(
    document: Node, shared: Mapping[str, scene.SharedValue], problems: Problems, known: _Known
) -> SceneConfig:
    lists = {key: known.resolve(document.entries[key], shared, key) for key in VARYING}
    return SceneConfig(
        tuple(sorted(shared.items())),
        _plugins(lists["elements"], "elements", ELEMENTS, problems, known),
        _plugins(lists["randomizers"], "randomizers", RANDOMIZERS, problems, known),
        _plugins(lists["sensors"], "sensors", SENSORS, problems, known),
    )


def _plugins(
    listed: Node, key: str, table: PluginTable[P], problems: Problems, known: _Known
) -> tuple[P, ...]:
    """Make the plug-in of each item without errors; names, if they have one, must be unique."""
    if not isinstance(listed.content, tuple):
        problems.add(listed.position, key, f"expected a list of {table.kind}s")
    made: list[P] = []
    names: set[str] = set()
    tag = "name" if key in VARYING else "type"
    inherited = {merging.node_name(node) for node in listed.items if node.get("type")}
    for number, node in enumerate(listed.items):
        make = partial(_plugin, node, f"{key}[{number}]", table, problems, inherited=inherited)
        plugin = known.plugin(key, node, make)
        name = getattr(plugin, tag, None)
        if name is not None and name in names:
            fact = f"the name '{name}' is taken; expected a unique name"
            if tag == "type":
                fact = f"the {table.kind} '{name}' is listed twice; expected it once"
            problems.add((node.get(tag) or node).position, f"{key}[{number}].{tag}", fact)
        if name is not None:
            names.add(name)
        if plugin is not None:
            made.append(plugin)
    return tuple(made)


def _plugin(
    node: Node,
    field: str,
    table: PluginTable[P],
    problems: Problems,
    default: str | None = None,
    *,
    inherited: Collection[str] = (),
) -> P | None:
    """Make the plug-in that an entry names, or else the default one; None if it has errors.

    ``inherited`` has the names that an entry without a type might have meant.
    """
    tag = node.get(table.tag)
    name = default if tag is None else tag.content
    where = (tag or node).position
    if not isinstance(name, str):
        named = "" if tag is not None else f"a mapping with '{table.tag}', which names "
        fact = f"expected {named}one {table.kind} of: {', '.join(table)}"
        own = node.get("name")
        if tag is None and own is not None and inherited:
            near = errors.did_you_mean(own.text, sorted(inherited))
            fact = f"nothing inherited is named {quote_value(own.content)}{near}; {fact}"
            where = own.position
        problems.add(where, f"{field}.{table.tag}", fact)
        return None
    try:
        model = cast("type[Strict]", table.load(name))
        return cast("P | None", validate(node, model, problems, field))
    except errors.ConfigError as refused:
        fact = f"{refused}{find_other_list(name, table)}"
        problems.add(where, f"{field}.{table.tag}", fact)
        return None


def _annotations(listed: Node, problems: Problems) -> dict[str, interfaces.AnyAnnotator]:
    """Annotators by name; an item is a name, or a mapping with ``type`` and parameters."""
    items = listed.items if isinstance(listed.content, tuple) else (listed,)
    made: dict[str, interfaces.AnyAnnotator] = {}
    for number, node in enumerate(items):
        field = f"annotations[{number}]"
        kind = node.get("type") or node
        name = kind.content
        if not isinstance(name, str) or name not in ANNOTATIONS:
            fact = f"unknown annotation {name!r}; expected one of {', '.join(ANNOTATIONS)}"
            fact += errors.did_you_mean(str(name), ANNOTATIONS)
            fact += find_other_list(str(name), ANNOTATIONS)
            problems.add(kind.position, field, fact)
        elif kind is not node and name in made:
            problems.add(node.position, field, f"the annotation '{name}' is listed twice")
        else:
            entry = Node(node.position, {"type": node}) if kind is node else node
            annotator = _plugin(entry, field, ANNOTATIONS, problems)
            if annotator is not None:
                made.setdefault(name, annotator)
    return made
