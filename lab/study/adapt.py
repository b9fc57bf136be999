"""Rounds of a curriculum: configurations that draw more of the objects that a detector missed.

A curriculum is a folder with ``curriculum.yaml`` and one configuration per round. Each
configuration extends the one before by new weights: ``gen-data --config`` makes the data of any
round again, byte for byte.
"""

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gen_data.api.config import load_config
from gen_data.api.dataset import SampleSequence
from gen_data.api.open_dataset import open_dataset
from gen_data.api.sample import Sample
from gen_data.config.yaml_scalars import to_flow_yaml
from gen_data.core.errors import ConfigError, StorageError, VerificationError
from gen_data.core.serialization import canonical_json
from gen_data.lab.matching.label_files import Box, RealObject
from gen_data.lab.study import experiment, findings
from gen_data.lab.study.evaluation import check_results, evaluate
from gen_data.lab.study.real_pictures import RealPicture, RealSet
from gen_data.lab.study.reweighting import ALPHA, Dependence, Tally, find_dependences
from gen_data.report.drawn_parameters import replay_scenes
from gen_data.runner.durable_files import write_durably
from gen_data.runner.stored import StoredSamples
from gen_data.targets import detection_target

if TYPE_CHECKING:
    from gen_data.assemble.config import Config

CURRICULUM = "curriculum.yaml"


@dataclass(frozen=True)
class Round:
    """A round of a curriculum.

    Attributes:
        number: From 1.
        config: File of its configuration.
        recall: Share of objects of the judged data set that were found.
        dependences: All tested parameters, the surest first.
        changed: Names of those whose weights were changed.
        images: Numbers of images with detections, and of all images that were judged.
    """

    number: int
    config: Path
    recall: float
    dependences: tuple[Dependence, ...]
    changed: tuple[str, ...]
    images: tuple[int, int] = (0, 0)


def adapt(
    config: str,
    data: Path,
    out: Path,
    *,
    results: Path | None = None,
    detector: Path | None = None,
    strength: float = 1.0,
) -> Round:
    """Write the next round of a curriculum.

    Args:
        config: The configuration of the data set: of the round before, or any at first.
        data: A finished data set of it, that the detector was judged by and did not train on.
        out: Folder of the curriculum.
        results: Detections of any detector in the images of all its colour cameras, in COCO's
            format of results, with the image and category ids of its COCO export; or an object with
            ``dataset``, its identity, and ``results``.
        detector: Instead: a file of the small detector.
        strength: Exponent of the ratio of misses; see ``Dependence.factors``.

    Raises:
        ConfigError: the data set is not of this configuration, the results are of another data set,
            or nothing was missed.
        VerificationError: a scene that is drawn again is not the stored one.
    """
    if (results is None) == (detector is None):
        raise ConfigError("expected either results or a detector")
    if not 0.0 < strength <= 4.0:
        raise ConfigError(f"strength: {strength:g}; expected a number above 0, up to 4")
    loaded, kept = load_config(config), StoredSamples(data)
    _check_same(loaded, data)
    with open_dataset(data) as stored:
        has_map = bool((stored.config.get("labels") or {}).get("map"))
        samples: SampleSequence = stored.relabelled() if has_map else stored
        truth, sample_of = _read_truth(samples, data)
        if detector is not None:
            rows = _detect(detector, samples, truth)
        else:
            assert results is not None
            rows = _read_checked(results, kept, truth)
    tallies = _count(truth, rows, sample_of)
    replay = replay_scenes(kept, kept.n)
    if replay.differences:
        raise VerificationError(
            f"{data}: {replay.differences[0]}; expected the version of gen-data that made it"
        )
    dependences = find_dependences(replay.draws, tallies)
    images = len({row["image_id"] for row in rows}), len(truth.pictures)
    made = _write_round(config, loaded, kept, out, tallies, dependences, strength)
    return replace(made, images=images)


def _check_same(loaded: "Config", data: Path) -> None:
    """Refuse a data set of another configuration; changes by plans or exports are allowed."""
    free = ("seed", "exporters", "physics", "shard_size")
    stored = load_config(str(data))
    first, second = (
        {key: value for key, value in one.resolved.items() if key not in free}
        for one in (loaded, stored)
    )
    if canonical_json(first) != canonical_json(second):
        different = sorted(k for k in {*first, *second} if first.get(k) != second.get(k))
        raise ConfigError(
            f"{data}: was not generated from {loaded.name}: the sections {', '.join(different)} "
            "differ; expected the configuration that made it"
        )


def _photographs(samples: SampleSequence) -> Iterator[tuple[Sample, str]]:
    for sample in samples:
        for name in sorted(sample.cameras):
            if "rgb" in sample.cameras[name].channels:
                yield sample, name


def _read_truth(samples: SampleSequence, data: Path) -> tuple[RealSet, dict[int, int]]:
    """Objects in all photographs, under the image ids of COCO exports, and samples by these ids."""
    pictures, sample_of = [], {}
    names = ("", *samples.categories)
    for sample, camera in _photographs(samples):
        image, target = detection_target(sample, camera, ignored=True)
        things = tuple(
            RealObject(names[int(label)], _sides(box), bool(crowd))
            for box, label, crowd in zip(
                target["boxes"], target["labels"], target["iscrowd"], strict=True
            )
        )
        image_id = sample.image_id(camera)
        sample_of[image_id] = sample.index
        pictures.append(RealPicture(image_id, data, (image.shape[2], image.shape[1]), things))
    ids = {name: number for number, name in enumerate(samples.categories, 1)}
    return RealSet(data, tuple(pictures), ids, {}), sample_of


def _sides(box: NDArray[np.float32]) -> Box:
    x0, y0, x1, y1 = box.tolist()
    return x0, y0, x1, y1


def _read_checked(path: Path, judged: StoredSamples, truth: RealSet) -> list[dict[str, Any]]:
    identity = judged.dataset_id
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: cannot be read as JSON ({error})") from error
    if isinstance(content, Mapping):
        if content.get("dataset", identity) != identity:
            raise ConfigError(
                f"{path}: has results of the data set {content['dataset']}; expected results of "
                f"{identity} in {judged.folder}"
            )
        content = content.get("results")
    rows = check_results(content, path, truth)
    if strange := {row["image_id"] for row in rows} - {one.image_id for one in truth.pictures}:
        raise ConfigError(
            f"{path}: has results of another data set: the image_id {min(strange, key=str)} is not "
            f"in {judged.folder}"
        )
    return rows


def _detect(path: Path, samples: SampleSequence, truth: RealSet) -> list[dict[str, Any]]:
    experiment.require_torch("adapt")
    from gen_data.lab.study.detector import Detector
    from gen_data.lab.study.training import detect_in_images

    images = (
        (picture.image_id, detection_target(sample, camera)[0].transpose(1, 2, 0))
        for picture, (sample, camera) in zip(truth.pictures, _photographs(samples), strict=True)
    )
    return detect_in_images(Detector.load(path), images, truth.category_ids)


def _count(
    truth: RealSet, rows: Sequence[Mapping[str, Any]], sample_of: Mapping[int, int]
) -> dict[int, Tally]:
    """Objects and misses by number of the sample, in all of its photographs."""
    evaluation = evaluate(truth, rows)
    counts = {number: [0, 0] for number in sample_of.values()}
    for match in evaluation.matches:
        if match.thing is not None:
            number = sample_of[evaluation.pictures[match.picture].image_id]
            counts[number][0] += 1
            counts[number][1] += match.box is None
    return {number: Tally(*pair) for number, pair in counts.items()}


def _write_round(
    config: str,
    loaded: "Config",
    judged: StoredSamples,
    out: Path,
    tallies: Mapping[int, Tally],
    dependences: Sequence[Dependence],
    strength: float,
) -> Round:
    objects = sum(tally.objects for tally in tallies.values())
    missed = sum(tally.missed for tally in tallies.values())
    if not missed:
        raise ConfigError(
            f"{judged.folder}: the detector found all {objects} objects; expected misses to learn "
            "from: judge by a harder or larger data set"
        )
    chosen = [d for d in dependences if d.p < ALPHA and _place(d.name) is not None]
    path = out / CURRICULUM
    rounds = _read_rounds(path)
    number = len(rounds) + 1
    file = out / f"round_{number}.yaml"
    text = _format_config(config, loaded, file, chosen, number, strength)
    rounds.append(
        {
            "round": number,
            "config": file.name,
            "sha256": hashlib.sha256(text.encode()).hexdigest(),
            "seed": loaded.general.seed + 1,
            "judged": judged.dataset_id,
            "objects": objects,
            "missed": missed,
            "strength": strength,
            "weights": {d.name: d.reweighted(strength).to_yaml() for d in chosen},
        }
    )
    try:
        out.mkdir(parents=True, exist_ok=True)
        write_durably(file, text.encode(), out)
        write_durably(path, _to_yaml({"rounds": rounds}).encode(), out)
    except OSError as error:
        raise StorageError(f"{out}: {error.strerror}") from error
    recall = 1.0 - missed / objects
    return Round(number, file, recall, tuple(dependences), tuple(d.name for d in chosen))


def _format_config(
    config: str,
    loaded: "Config",
    file: Path,
    chosen: Sequence[Dependence],
    number: int,
    strength: float,
) -> str:
    document: dict[str, Any] = {
        "extends": os.path.relpath(config, file.parent) if Path(config).is_file() else config,
        "seed": loaded.general.seed + 1,
    }
    for dependence in chosen:
        place = _place(dependence.name)
        assert place is not None
        section, keys = place
        weights = dependence.reweighted(strength).to_yaml()
        if section == "shared":
            document.setdefault("shared", {})[keys[0]] = weights
            continue
        items = document.setdefault("randomizers", [])
        item = next((i for i in items if i["name"] == keys[0]), None)
        if item is None:
            item = {"name": keys[0]}
            items.append(item)
        for key in keys[1:-1]:
            item = item.setdefault(key, {})
        item[keys[-1]] = weights
    title = f"# Round {number}: more of the missed objects, within the ranges of {config}.\n"
    return title + _to_yaml(document)


def _place(name: str) -> tuple[str, list[str]] | None:
    """Section and keys of a parameter; None if it is inside a list, whose items have no names."""
    if "[" in name:
        return None
    first, *rest = name.split(".")
    return ("shared", rest) if first == "shared" else ("randomizers", [first, *rest])


def _read_rounds(path: Path) -> list[dict[str, Any]]:
    import yaml

    if not path.is_file():
        return []
    try:
        rounds = yaml.safe_load(path.read_text("utf-8"))["rounds"]
        return list(rounds)
    except (yaml.YAMLError, KeyError, TypeError) as error:
        raise ConfigError(f"{path}: not a curriculum ({error!r})") from error


def _to_yaml(value: Any) -> str:
    import yaml

    text: str = yaml.safe_dump(value, sort_keys=False, allow_unicode=True, default_flow_style=None)
    return text


def tabulate(made: Round, strength: float) -> findings.Table:
    """The parameters that misses depend on, and those nearest to it."""
    shown = [d for d in made.dependences if d.p < ALPHA] or list(made.dependences[:5])
    rows = []
    for dependence in shown:
        shares = [
            f"{100.0 * missed / objects:.0f}" if objects else "-"
            for missed, objects in zip(dependence.missed, dependence.objects, strict=True)
        ]
        factors = [f"{factor:.2g}" for factor in dependence.factors(strength)]
        is_changed = dependence.name in made.changed
        rows.append(
            [
                dependence.name,
                to_flow_yaml(dependence.declared.to_yaml()),
                f"{dependence.p:.4f}",
                " ".join(shares),
                " ".join(factors) if is_changed else "unchanged",
            ]
        )
    return {
        "title": f"round {made.number}: recall {made.recall:.3f}",
        "header": ["parameter", "declared", "p", "missed by bin [%]", "factors of weights"],
        "rows": rows,
        "note": f"{len(made.dependences)} parameters were tested; p adjusted by Holm; "
        f"{made.images[0]} of {made.images[1]} images have detections"
        + ("" if made.changed else "; no weight was changed"),
    }
