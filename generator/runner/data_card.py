"""Card and metadata at the root of every data set: ``README.md`` and ``croissant.json``.

Both depend on the plan and on the records of shards only. They describe images as sets of files,
which keeps their size independent of the number of samples.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from gen_data.annotations.annotate import Thresholds
from gen_data.config.data_files import load_data
from gen_data.config.yaml_scalars import to_flow_yaml
from gen_data.core.asset_types import LAYER_MATERIALS
from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo, Modality, SensorInfo
from gen_data.core.markdown import plain
from gen_data.exporters.croissant_metadata import (
    croissant_document,
    describe_dataset,
    extract,
    file_object,
    file_set,
    record_set,
    title_of,
)
from gen_data.runner import layout, licence_table, provenance, shard_record
from gen_data.runner.labels import LABELS_NAME
from gen_data.runner.plan import Plan, plan_bytes

CARD_NAME = "README.md"
CROISSANT_NAME = "croissant.json"

LABELS_ID = "labels"
"""Id of the set of ``labels.jsonl`` files."""


@dataclass(frozen=True, slots=True)
class DatasetFacts:
    """Everything that card and metadata state.

    Attributes:
        splits: Counts of the whole data set, sorted by split.
        scenes: Number of scenes.
        formats: Names of the folders of exporters.
        asset_licences: Text of ``LICENSES-ASSETS.md``; None = no such file.
    """

    plan: Plan
    info: DatasetInfo
    splits: Sequence[shard_record.SplitCount]
    scenes: int
    formats: Sequence[str]
    asset_licences: str | None = None

    @property
    def licences(self) -> list[str]:
        """Names of the licences of its assets, sorted."""
        return licence_table.licences_in(self.asset_licences or "")


def croissant_json(facts: DatasetFacts) -> str:
    """Content of ``croissant.json``: Croissant 1.0, which ``mlcroissant`` loads.

    Record sets: ``samples`` (index, split, categories and ids of the labelled objects) and, per
    camera with photographs, ``<camera>-rgb`` (sample, file name, pixels).
    """
    plan = plan_bytes(facts.plan)
    digest = hashlib.sha256(plan).hexdigest()
    distribution = [
        file_object(layout.PLAN_NAME, len(plan), digest, "application/json"),
        *_file_sets(facts),
    ]
    cameras = [s for s in facts.info.sensors if Channel.RGB in s.channels]
    records = [_sample_records(), *(_image_records(camera.name) for camera in cameras)]
    document = croissant_document(facts.info, facts.licences, distribution, records)
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def _file_sets(facts: DatasetFacts) -> Iterator[dict[str, Any]]:
    lines = "application/jsonlines"
    labels = "All annotations; a line per sample."
    yield file_set(LABELS_ID, labels, lines, f"shards/*/{LABELS_NAME}")
    scenes = "Final scenes, from which the images can be rendered again; a line per sample."
    yield file_set("scenes", scenes, lines, f"shards/*/{provenance.SCENES_NAME}")
    for sensor in facts.info.sensors:
        name = sensor.name
        for channel in sensor.channels:
            meaning = _meaning(facts.info, channel.value)
            includes = f"shards/*/{name}/{channel.value}/*.png"
            yield file_set(f"{name}-{channel.value}", meaning, "image/png", includes)
        if sensor.modality is not Modality.CAMERA:
            folder = "points" if sensor.modality is Modality.LIDAR else "rows"
            meaning = _meaning(facts.info, sensor.modality.value)
            includes = f"shards/*/{name}/{folder}/*.npy"
            yield file_set(f"{name}-{folder}", meaning, "application/x-npy", includes)


def _sample_records() -> dict[str, Any]:
    """Record set of the lines of ``labels.jsonl``."""
    fields: dict[str, tuple[str, Mapping[str, Any]]] = {
        "index": ("sc:Integer", extract(LABELS_ID, {"column": "index"})),
        "split": ("sc:Text", extract(LABELS_ID, {"column": "split"})),
    }
    for field, kind, key in (
        ("instance_ids", "sc:Integer", "instance_id"),
        ("categories", "sc:Text", "category"),
    ):
        source = extract(LABELS_ID, {"column": "instances"}, {"jsonPath": key})
        fields[field] = (kind, source)
    records = record_set("samples", "Samples with their split and labelled objects.", fields)
    for field in records["field"][2:]:
        field["repeated"] = True
    return records


def _image_records(camera: str) -> dict[str, Any]:
    """Record set of the photographs of a camera; the name of a file is the sample's index."""
    name = f"{camera}-{Channel.RGB.value}"
    file_name = {"fileProperty": "filename"}
    return record_set(
        f"{name}-images",
        f"Photographs of the sensor {camera}.",
        {
            "sample": ("sc:Integer", extract(name, file_name, {"regex": r"^(\d+)\.png$"})),
            "file_name": ("sc:Text", extract(name, file_name)),
            "content": ("sc:ImageObject", extract(name, {"fileProperty": "content"})),
        },
    )


def data_card(facts: DatasetFacts) -> str:
    """Content of ``README.md``, in Markdown."""
    info, plan = facts.info, facts.plan
    names = [count.split for count in facts.splits]
    objects = [sum(count.objects.values()) for count in facts.splits]
    return _CARD.format(
        title=plain(title_of(info)),
        description=plain(describe_dataset(info)),
        samples=_samples_text(facts),
        scenes=facts.scenes,
        views=info.views_per_scene,
        steps=_steps(info),
        splits=_table(
            (c.split, c.samples, total) for c, total in zip(facts.splits, objects, strict=True)
        ),
        split_names=" | ".join(names),
        split_lines="---|" * len(names),
        categories=_table(
            (number, name, *(count.objects.get(name, 0) for count in facts.splits))
            for number, name in enumerate(info.categories, 1)
        ),
        sensors=_table(_sensor_rows(info)),
        formats="\n".join(f"- [`{name}/`]({name}/)" for name in sorted(facts.formats))
        or "- none besides the shards",
        settings=_table(_settings(plan)),
        thresholds="\n".join(f"- {fact}" for fact in _label_limits(plan)),
        versions=", ".join(f"{name} {release}" for name, release in sorted(plan.versions.items())),
        seed=plan.seed,
        n=plan.n,
        licence=_licence_text(facts),
        citation=_citation(info),
    )


def _samples_text(facts: DatasetFacts) -> str:
    samples = sum(count.samples for count in facts.splits)
    if samples == facts.plan.n:
        return str(samples)
    gone = f"{facts.plan.n - samples} of {facts.plan.n} could not be made"
    return f"{samples} (`failed` in [manifest.json](manifest.json): {gone})"


def _label_limits(plan: Plan) -> Iterator[str]:
    """Sentences on the objects that the configuration does not annotate, and on its 3D boxes."""
    given: Mapping[str, Any] = plan.config.get("labels") or {}
    own = {name: given[name] for name in Thresholds.model_fields if name in given}
    limits = Thresholds.model_validate(own)
    if limits.include_invisible:
        yield "All objects are annotated in every image, hidden ones too."
    else:
        share = f"{limits.min_visible_fraction:g} of the silhouette"
        yield (
            f"An object is annotated in an image if at least {limits.min_visible_px} pixels"
            + (f" and {share}" if limits.min_visible_fraction > 0.0 else "")
            + f" are visible, in a box of at least {limits.min_box_px} pixels a side"
            " (`labels.min_visible_px`, `min_visible_fraction`, `min_box_px`); smaller ones are"
            " in the images of instance ids only."
        )
    if given.get("map"):
        listed = ", ".join(f"{key}: {to_flow_yaml(value)}" for key, value in given["map"].items())
        yield f"Formats also follow the label map `{listed}`."
    extent = given.get("box3d", "body")
    if extent != "all":
        yield f"3D boxes of vehicles leave out exterior mirrors (`labels.box3d: {extent}`)."
        if extent == "annotated":
            yield "3D boxes of people enclose a whole stride and 5 cm on each side and above."
    else:
        yield "3D boxes enclose all of an object, with the mirrors of vehicles."


def _steps(info: DatasetInfo) -> str:
    if info.steps_per_scene == 1:
        return "one instant per view"
    return f"{info.steps_per_scene} instants per view, {info.step_s:g} s apart"


def _table(rows: Iterator[tuple[Any, ...]]) -> str:
    return "\n".join("| " + " | ".join(map(plain, row)) + " |" for row in rows)


def _sensor_rows(info: DatasetInfo) -> Iterator[tuple[Any, ...]]:
    for sensor in info.sensors:
        rate = f"{sensor.rate_hz:g} Hz" if sensor.rate_hz is not None else "every step"
        for folder, meaning in _outputs(info, sensor):
            path = f"`shards/*/{sensor.name}/{folder}/`"
            yield sensor.name, sensor.kind or sensor.modality.value, path, meaning, rate


def _outputs(info: DatasetInfo, sensor: SensorInfo) -> Iterator[tuple[str, str]]:
    for channel in sensor.channels:
        yield channel.value, _meaning(info, channel.value)
    if sensor.modality is Modality.LIDAR:
        yield "points", _meaning(info, "lidar")
        if sensor.origins:
            yield "origins", _meaning(info, "origins")
    if sensor.modality is Modality.DEVICE:
        columns = ", ".join(column.name for column in sensor.columns)
        yield "rows", f"{_meaning(info, 'device')}: {columns}"


def _meaning(info: DatasetInfo, key: str) -> str:
    """Meaning of a channel's pixels, or of the files of a modality."""
    texts = _meanings()
    text = texts["channels"].get(key) or texts.get(key) or key
    materials = ", ".join(f"{k} {name}" for k, name in enumerate(LAYER_MATERIALS) if name)
    return str(text).replace("{scale}", f"{info.depth_scale_m:g}").replace("{materials}", materials)


@cache
def _meanings() -> Mapping[str, Any]:
    loaded: Mapping[str, Any] = load_data(__package__, "data_card")
    return loaded


def _settings(plan: Plan) -> Iterator[tuple[str, str]]:
    for key, value in sorted(plan.config.items()):
        if isinstance(value, (list, tuple)):
            names = [_item_name(item) for item in value]
        elif isinstance(value, Mapping):
            names = sorted(str(name) for name in value)
        else:
            names = [str(value)]
        if names:
            yield key, ", ".join(names)


def _item_name(item: Any) -> str:
    """Name of a plug-in's entry, with its type in parentheses if both are stated."""
    if not isinstance(item, Mapping):
        return str(item)
    name, kind = item.get("name"), item.get("type")
    if name and kind and name != kind:
        return f"{name} ({kind})"
    return str(name or kind or ", ".join(sorted(map(str, item))))


def _licence_text(facts: DatasetFacts) -> str:
    own = facts.info.publication.license
    lines = [f"The data set: {plain(own)}." if own else "The publisher has stated no licence."]
    if facts.asset_licences is not None:
        names = plain(", ".join(facts.licences)) or "none"
        lines.append(
            f"Licences of the assets in its scenes: {names}. "
            "[LICENSES-ASSETS.md](LICENSES-ASSETS.md) lists their sources and authors."
        )
    return "\n\n".join(lines)


def _citation(info: DatasetInfo) -> str:
    """Section on creators, page and citation; empty without any."""
    facts = info.publication
    lines = [
        f"Creators: {plain(', '.join(facts.creators))}." if facts.creators else "",
        f"Published: {facts.date_published}." if facts.date_published else "",
        f"Web page: <{plain(facts.url)}>." if facts.url else "",
        f"```\n{facts.cite_as.strip().replace('```', '')}\n```" if facts.cite_as else "",
    ]
    text = "\n\n".join(line for line in lines if line)
    return f"\n## Publication\n\n{text}\n" if text else ""


_CARD = """# {title}

{description}

## Contents

{samples} samples of {scenes} scenes: {views} views per scene, {steps}.

| split | samples | visible objects |
|---|---|---|
{splits}

Visible objects by category:

| id | category | {split_names} |
|---|---|{split_lines}
{categories}

An object counts once per image in which it has a visible pixel.

## Sensors

| sensor | kind | files, `<sample>.png` or `<sample>.npy` | content | rate |
|---|---|---|---|---|
{sensors}

## Formats

{formats}

Formats hard-link the images of the shards where their layout allows.

## Load

```python
import gen_data

for sample in gen_data.open("."):
    ...  # sample.capture has images and points, sample.truth the annotations by camera
```

`mlcroissant.Dataset("croissant.json").records("samples")` reads indices, splits and objects
without gen-data; `shards/*/labels.jsonl` has all annotations as JSON, a line per sample.

## Verify

`sha256sum --check --quiet SHA256SUMS` or `gen-data verify --full .`: all files are as they were
generated. The same configuration, seed and versions give the same bytes.

## Labels and limits

- Labels come from the geometry of the scene: the ray through a pixel's centre decides its labels.
- Boxes are tight around the visible pixels of an object; pixel i covers [i, i + 1).
{thresholds}
- Cameras have X right, Y down, Z forward; the world has Z up; units are metres, seconds, radians.
- Ids of instances are the same in all views of a scene. Splits are drawn per scene.
- The images are synthetic. Distributions of objects, light and viewpoints come from the
  configuration, not from a real place; measure on real data before you rely on a model.
- No image shows a real person, and none a real place, except for photographed panoramas and
  scanned assets that the table of assets names.

## Provenance

gen-data with seed {seed}, {n} samples; [plan.json](plan.json) has the whole configuration.

| section | content |
|---|---|
{settings}

Versions: {versions}.

## Licence

{licence}
{citation}"""
