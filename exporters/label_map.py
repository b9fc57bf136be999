"""Label maps: which objects an export has, and under which names.

A label map works between the samples and an exporter: shards and ``labels.jsonl`` keep every object
of the data set under its own category.
"""

import warnings
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cache, cached_property
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

import yaml
from pydantic import Field, field_validator, model_validator

from gen_data.config.base_model import Strict
from gen_data.core import capture, path_names
from gen_data.core.errors import ConfigError, ConfigWarning, did_you_mean, list_names
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import ImageTruth, ObjectTruth, Sample
from gen_data.core.scene import Instance, Scene
from gen_data.exporters.base import WrappedExporter

PublicList = Literal["coco80", "kitti", "nuscenes", "cityscapes", "nyu40", "ade20k"]
Sources = tuple[str, ...]
"""Categories of the data set, or ``category/subcategory``."""
Classes = Mapping[str, Sources | None]


class LabelMap(Strict):
    """Which objects exports have, and under which class names.

    Formats with prescribed classes, such as KITTI's eight types, leave out and ignore the same
    objects, but keep their own names.

    Attributes:
        classes: ``{class: categories}``, in the order of class ids; a class without categories
            takes the category of its name. Plans have a list of such with one class each. Or the
            name of a public list: ``coco80``, ``kitti``, ``nuscenes``, ``cityscapes``, ``nyu40``,
            ``ade20k``. Without it, all categories keep their names. ``category/subcategory`` stands
            for these objects only, and goes before their category, here and below.
        others: Objects of all other categories: left out, or kept as ignored regions (in formats
            that have such regions without a class, such as KITTI's DontCare).
        ignore: Categories whose objects become ignored regions.
        drop: Categories whose objects are left out, such as ``apple/half``.
        min_visible_fraction: Smallest visible share of the silhouette (annotation ``visibility``).
        min_box_px: Smallest side of the box of the visible pixels.
        max_truncation: Largest share of the silhouette outside the image (annotation
            ``visibility``).
        min_detectability: Smallest contrast over noise, d' (annotation ``detectability``); 0 = any.
        below: Objects that miss one of these limits: left out, or kept as ignored regions.
    """

    classes: PublicList | Classes | None = None
    others: Literal["drop", "ignore"] = "drop"
    ignore: tuple[str, ...] = ()
    drop: tuple[str, ...] = ()
    min_visible_fraction: float = Field(0.0, ge=0.0, le=1.0)
    min_box_px: int = Field(1, ge=1)
    max_truncation: float = Field(1.0, ge=0.0, le=1.0)
    min_detectability: float = Field(0.0, ge=0.0)
    below: Literal["drop", "ignore"] = "drop"

    @field_validator(
        "classes",
        mode="before",
        json_schema_input_type=PublicList | Classes | tuple[Classes, ...] | None,
    )
    @classmethod
    def _listed(cls, classes: object) -> object:
        """A single category needs no list. Tuples, as strict validation takes no lists here.

        A list of ``{class: categories}``, as in plans, keeps its order in files that sort keys.
        """
        if isinstance(classes, (list, tuple)):
            if not all(isinstance(one, Mapping) and len(one) == 1 for one in classes):
                raise ValueError("expected {class: categories}, or a list of such with one class")
            names = [name for one in classes for name in one]
            if len({*names}) < len(names):
                raise ValueError("a class is listed twice")
            classes = {name: own for one in classes for name, own in one.items()}
        if not isinstance(classes, Mapping):
            return classes
        return {
            name: (own,) if isinstance(own, str) else tuple(own) if isinstance(own, list) else own
            for name, own in classes.items()
        }

    @model_validator(mode="after")
    def _has_each_category_once(self) -> "LabelMap":
        seen: dict[str, str] = {}
        for name, categories in self.classes_of.items():
            try:
                path_names.check_name(name, path_names.CATEGORY_MAX)
            except ValueError as error:
                raise ValueError(f"class {error}") from None
            for category in categories:
                if category in seen:
                    raise ValueError(
                        f"category '{category}' belongs to the classes '{seen[category]}' and "
                        f"'{name}'; expected one class"
                    )
                seen[category] = name
        fates = {**dict.fromkeys(self.ignore, "ignored"), **dict.fromkeys(self.drop, "dropped")}
        for category, fate in fates.items():
            if isinstance(self.classes, Mapping) and category in seen:
                raise ValueError(
                    f"category '{category}' is {fate} and belongs to the class "
                    f"'{seen[category]}'; expected one of the two"
                )
        return self

    @property
    def is_identity(self) -> bool:
        """Whether it changes nothing."""
        return self == LabelMap()

    @property
    def needs(self) -> frozenset[str]:
        """Names of the annotators that its limits read."""
        limited = self.min_visible_fraction > 0.0 or self.max_truncation < 1.0
        read = {"visibility": limited, "detectability": self.min_detectability > 0.0}
        return frozenset(name for name, is_read in read.items() if is_read)

    @property
    def classes_of(self) -> Mapping[str, Sources]:
        """Categories by class; empty without ``classes``."""
        if self.classes is None:
            return {}
        listed = public_classes(self.classes) if isinstance(self.classes, str) else self.classes
        return {name: (name,) if own is None else own for name, own in listed.items()}

    @property
    def named(self) -> Sources:
        """All categories and subcategories that the user names."""
        classes = self.classes_of if isinstance(self.classes, Mapping) else {}
        return (*(c for own in classes.values() for c in own), *self.ignore, *self.drop)

    def check(self, categories: Sequence[str]) -> None:
        """Compare the map with the categories of a data set.

        Raises:
            ConfigError: a class of the user has categories, but none of the data set; or no class
                of a public list has one.

        Warns:
            ConfigWarning: the user named a category that the data set does not have, besides others
                that it has. A map may serve several data sets, so this is not an error.
        """
        faults = self.faults(categories)
        if faults:
            texts = (f"labels.map.classes.{name}: {fact}" for name, fact in faults.items())
            raise ConfigError("\n".join(texts))
        for category in self.named:
            if category_of(category) not in categories:
                text = f"labels.map: the data set has no category '{category}'"
                warnings.warn(
                    text + did_you_mean(category, categories), ConfigWarning, stacklevel=2
                )
        used = {category_of(c) for own in self.classes_of.values() for c in own}
        if self.classes is not None and not used & set(categories):
            raise ConfigError(
                "labels.map.classes: no class has a category of the data set; expected some of: "
                f"{', '.join(categories)}"
            )

    def faults(self, categories: Sequence[str]) -> Mapping[str, str]:
        """Facts about the user's classes that no object of a data set can have, by class."""
        if not isinstance(self.classes, Mapping):
            return {}
        any_case = {category.lower(): category for category in categories}
        found = {}
        for name, own in self.classes_of.items():
            if own and not set(map(category_of, own)) & set(categories):
                near = [k for c in own for k in get_close_matches(c.lower(), any_case, n=1)]
                guess = f" (did you mean '{any_case[near[0]]}'?)" if near else ""
                named = ", ".join(f"'{category}'" for category in own)
                found[name] = (
                    f"no object of the data set can be {named}{guess}; expected some of "
                    f"{list_names(categories, 40)}; or [] for a class without objects"
                )
        return found


def in_order(config: Mapping[str, Any]) -> Mapping[str, Any]:
    """A configuration whose classes are a list, the order of which is part of its JSON."""
    labels = config.get("labels") or {}
    classes = (labels.get("map") or {}).get("classes")
    if not isinstance(classes, Mapping):
        return config
    listed = [{name: own} for name, own in classes.items()]
    return {**config, "labels": {**labels, "map": {**labels["map"], "classes": listed}}}


def category_of(source: str) -> str:
    """The category of ``category`` or ``category/subcategory``."""
    return source.partition("/")[0]


def _find(instance: Instance, sources: Container[str]) -> str:
    """The source that stands for an instance, its subcategory first; empty if there is none."""
    finer = f"{instance.category}/{instance.subcategory}"
    return next((name for name in (finer, instance.category) if name in sources), "")


@cache
def public_classes(name: str) -> Mapping[str, Sources | None]:
    """Classes of a public data set, in order, with our categories; see ``label_maps.yaml``."""
    text = files("gen_data.exporters").joinpath("label_maps.yaml").read_text("utf-8")
    listed: Mapping[str, list[str] | None] = yaml.safe_load(text)[name]
    return {k: None if v is None else tuple(v) for k, v in listed.items()}


@dataclass(frozen=True)
class MappedExporter(WrappedExporter):
    """An exporter that sees a data set through a label map."""

    label_map: LabelMap

    @property
    def needs(self) -> frozenset[str]:
        """Annotators of the exporter and of the limits."""
        return self.exporter.needs | self.label_map.needs

    def check(self, info: DatasetInfo) -> None:
        """Refuse as the exporter does."""
        self.exporter.check(self._mapping(info).info)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the mapped labels of one shard."""
        mapping = self._mapping(info)
        self.exporter.write_shard(mapping.info, map(mapping.map_sample, samples), shard_dir)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Merge all shards."""
        self.exporter.finalize(self._mapping(info).info, shard_dirs, dataset_dir)

    def _mapping(self, info: DatasetInfo) -> "AppliedLabelMap":
        return AppliedLabelMap(self.label_map, info, renames=not self.exporter.has_own_classes)


@dataclass(frozen=True)
class AppliedLabelMap:
    """A label map of one data set.

    Attributes:
        renames: Whether objects take the names of their classes.
    """

    label_map: LabelMap
    dataset: DatasetInfo
    renames: bool = True

    @cached_property
    def info(self) -> DatasetInfo:
        """The data set as the exporter sees it.

        It has no images of category ids if the classes differ, as their pixels hold the data set's.
        """
        if not self.has_classes:
            return self.dataset
        sensors = tuple(
            replace(s, channels=tuple(c for c in s.channels if c is not capture.Channel.CATEGORY))
            for s in self.dataset.sensors
        )
        classes = tuple(self.label_map.classes_of)
        return replace(
            self.dataset,
            categories=classes,
            sensors=sensors,
            own_categories=self.dataset.categories,
        )

    def map_sample(self, sample: Sample) -> Sample:
        """The sample with mapped labels."""
        truth = {name: self.map_image(image) for name, image in sample.truth.items()}
        instants = {name: self.map_scene(scene) for name, scene in sample.instants.items()}
        return replace(sample, truth=truth, scene=self.map_scene(sample.scene), instants=instants)

    @property
    def has_classes(self) -> bool:
        """Whether objects have other categories than in the data set."""
        return self.renames and self.label_map.classes is not None

    @cached_property
    def _class_of(self) -> Mapping[str, tuple[str, int]]:
        listed = enumerate(self.label_map.classes_of.items(), 1)
        return {category: (name, k) for k, (name, own) in listed for category in own}

    @cached_property
    def _sources(self) -> frozenset[str]:
        """All categories and subcategories that the map names."""
        return frozenset((*self.label_map.ignore, *self.label_map.drop, *self._class_of))

    def map_image(self, truth: ImageTruth) -> ImageTruth:
        """The annotations of an image with mapped objects."""
        objects = tuple(self._map_objects(truth.objects))
        kept = {thing.instance.instance_id for thing in objects}
        dropped = {t.instance.instance_id for t in truth.objects} - kept
        relations, utterances = truth.relations, truth.utterances
        if relations is not None:
            relations = tuple(r for r in relations if not {r.subject, r.object} & dropped)
        if utterances is not None:
            utterances = tuple(u for u in utterances if not dropped & set(u.instances))
        return replace(truth, objects=objects, relations=relations, utterances=utterances)

    def _map_objects(self, objects: Iterable[ObjectTruth]) -> Iterator[ObjectTruth]:
        for thing in objects:
            fate = self._fate(thing)
            if fate != "drop":
                instance = self._map_instance(thing.instance)
                yield replace(thing, instance=instance, ignored=fate == "ignore")

    def _fate(self, thing: ObjectTruth) -> Literal["keep", "ignore", "drop"]:
        label_map, instance = self.label_map, thing.instance
        found = _find(instance, self._sources)
        if found in label_map.drop:
            return "drop"
        if found in label_map.ignore:
            return "ignore"
        if label_map.classes is not None and not found:
            return label_map.others
        return label_map.below if self._is_below(thing) else "keep"

    def _is_below(self, thing: ObjectTruth) -> bool:
        limits, box = self.label_map, thing.box
        if box is None:
            return False
        return (
            min(box.width_px, box.height_px) < limits.min_box_px
            or (
                thing.visible_fraction is not None
                and thing.visible_fraction < limits.min_visible_fraction
            )
            or (thing.truncation is not None and thing.truncation > limits.max_truncation)
            or (thing.detectability is not None and thing.detectability < limits.min_detectability)
        )

    def _map_instance(self, instance: Instance) -> Instance:
        """The instance under its class; ignored ones without a class have id 0."""
        if not self.has_classes:
            return instance
        found = _find(instance, self._class_of)
        name, number = self._class_of.get(found, (instance.category, 0))
        return replace(instance, category=name, category_id=number)

    def map_scene(self, scene: Scene) -> Scene:
        """The scene whose instances are mapped.

        Instances of ignored, dropped and other categories are not annotated, as no format of whole
        scenes has ignored regions.
        """
        without = {*self.label_map.drop, *self.label_map.ignore}
        needs_class = self.label_map.classes is not None

        def mapped(instance: Instance) -> Instance:
            found = _find(instance, self._sources)
            if found in without or (needs_class and not found):
                return replace(instance, annotated=False, category_id=0)
            return self._map_instance(instance)

        return replace(scene, instances=tuple(map(mapped, scene.instances)))
