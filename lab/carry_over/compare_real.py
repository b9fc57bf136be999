"""A data set or configuration next to the labelled pictures of a user: ``--compare-real``."""

import json
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from gen_data.core import errors
from gen_data.lab.carry_over import statistics
from gen_data.lab.carry_over.differences import Row, compare
from gen_data.lab.study.real_pictures import RealSet, read_real

if TYPE_CHECKING:
    from gen_data.assemble.config import Config

LABELS_READ = 300
"""Images of a data set in which the groups of its classes are looked up."""


@dataclass(frozen=True)
class Ours:
    """Labelled pictures of the product.

    Attributes:
        units: Number of the scene of each picture, from 0.
        config: Their configuration; None = a labelled folder without one.
        groups: Groups that draw objects of a class, by its name in lower case.
    """

    labels: RealSet
    units: Sequence[int]
    config: "Config | None"
    groups: Mapping[str, frozenset[str]]


@dataclass(frozen=True)
class CarryOver:
    """Result of a comparison.

    Attributes:
        source, folder: Our data set or configuration, and the real folder.
        rows: The largest difference first.
        few: Classes with statistics of too few values.
        one_sided: Quantities that the labels of one side alone state.
        heights: Boxes a picture by bins of ``HEIGHTS_PX``, real and ours, by class.
        remedies: Changes of fields for each row that differs, in order.
        unmatched: Numbers of boxes of classes without a counterpart, real and ours.
    """

    source: str
    folder: Path
    real: RealSet
    ours: RealSet
    rows: tuple[Row, ...]
    few: tuple[str, ...]
    one_sided: tuple[str, ...]
    heights: Mapping[str, tuple[list[float], list[float]]]
    remedies: tuple[tuple[str, ...], ...]
    unmatched: tuple[Mapping[str, int], Mapping[str, int]]


def compare_real(
    source: str,
    folder: Path,
    *,
    classes: Sequence[str] = (),
    pictures: int = 500,
    n: int = 60,
    progress: Callable[[str], None] = lambda _: None,
) -> CarryOver:
    """Compare the statistics that decide whether a detector carries over.

    Args:
        source: A finished data set, a folder with labels, or a configuration to sample.
        folder: Real pictures with labels, in one of ``real_pictures.LAYOUTS``.
        classes: ``REAL=OURS`` names; others correspond if they agree but for case.
        pictures: Largest number of pictures of each side, chosen evenly.
        n: Samples of a configuration.
        progress: Called with the name of each step when it begins.

    Raises:
        ConfigError: a folder has no labels, no class corresponds, or an argument is wrong.
        StorageError: files are missing or damaged.
        NoLabels: there are labels and no object.
    """
    if not folder.is_dir():
        raise errors.StorageError(errors.no_folder(folder))
    progress(f"labels of {folder}")
    real = read_real(folder, None, most=pictures)
    with _open_ours(source, real.layout, pictures, n, progress) as ours:
        label_of_real, label_of_ours = _match(real, ours.labels, folder, source, classes)
        progress("real pictures")
        units = range(len(real.pictures))
        measured = statistics.measure(real.pictures, units, label_of_real)
        progress("our pictures")
        mine = statistics.measure(ours.labels.pictures, ours.units, label_of_ours)
        rows, few, one_sided = compare(measured, mine, len(units), max(ours.units) + 1)
        return CarryOver(
            source,
            folder,
            real,
            ours.labels,
            rows,
            few,
            one_sided,
            _heights(measured, mine),
            tuple(_remedies(row, ours) for row in rows if row.differs),
            (_without(real, label_of_real), _without(ours.labels, label_of_ours)),
        )


def _heights(
    real: statistics.Measured, ours: statistics.Measured
) -> dict[str, tuple[list[float], list[float]]]:
    """Boxes a picture by height of both sides, the class with most boxes first."""
    every = {
        label: (
            statistics.heights_per_picture(real, label),
            statistics.heights_per_picture(ours, label),
        )
        for label, name in real
        if name == statistics.COUNT
    }
    return dict(sorted(every.items(), key=lambda item: -sum(map(sum, item[1]))))


def _remedies(row: Row, ours: Ours) -> tuple[str, ...]:
    from gen_data.lab.carry_over.fields import remedies

    return tuple(remedies(row, ours.config, ours.groups.get(row.label.casefold(), frozenset())))


@contextmanager
def _open_ours(
    source: str, layout: str, pictures: int, n: int, progress: Callable[[str], None]
) -> Iterator[Ours]:
    """Our pictures in a layout, which they are exported to, or generated in, if need be."""
    folder = Path(source)
    with TemporaryDirectory() as scratch:
        if folder.is_dir() and not (folder / "plan.json").is_file():
            labels = read_real(folder, None, most=pictures)
            yield Ours(labels, range(len(labels.pictures)), None, {})
            return
        if not folder.is_dir():
            from gen_data.api.generate import generate

            progress(f"{n} samples of {source}")
            folder = Path(scratch) / "sample"
            entry = json.dumps([{"type": layout}])
            every_scene = (f"exporters={entry}", "views_per_scene=1", "steps_per_scene=1")
            generate(source, n, out=folder, overrides=every_scene, resume_command="")
        exported = folder
        if not (folder / layout).is_dir():
            from gen_data.api.export import export

            progress(f"{source} as {layout}")
            exported = Path(scratch) / "exported"
            export(folder, [layout], exported, resume_command="")
        yield _stored(folder, read_real(exported / layout, None, layout=layout, most=pictures))


def _stored(folder: Path, labels: RealSet) -> Ours:
    """Pictures of a finished data set; the pictures of one scene are one unit."""
    from gen_data.assemble.config import load_config
    from gen_data.core.scene import Instance
    from gen_data.exporters.kitti import official_type
    from gen_data.report.label_gaps import read_label_map
    from gen_data.report.stored_labels import read_images
    from gen_data.runner.stored import StoredSamples

    stored = StoredSamples(folder)
    per_scene = stored.info.views_per_scene * stored.info.steps_per_scene
    # Names of exported images begin with the number of the sample.
    numbers = [int(re.match(r"\d+", p.path.stem)[0]) // per_scene for p in labels.pictures]  # type: ignore[index]
    units = np.unique(numbers, return_inverse=True)[1].tolist()
    class_of = {
        c: name for name, own in read_label_map(stored.config).classes_of.items() for c in own
    }
    groups: dict[str, set[str]] = {}
    for image in islice(read_images(stored), LABELS_READ):
        for item in image.objects:
            one = item["instance"]
            attributes = tuple(map(tuple, one["attributes"]))
            kind = official_type(Instance(0, "", one["category"], 0, "", attributes=attributes))
            for name in {one["category"], class_of.get(one["category"], ""), kind}:
                groups.setdefault(name.casefold(), set()).add(one["name"].partition("/")[0])
    frozen = {name: frozenset(listed) for name, listed in groups.items()}
    return Ours(labels, units, load_config(str(folder)), frozen)


def _match(
    real: RealSet, ours: RealSet, folder: Path, source: str, classes: Sequence[str]
) -> tuple[dict[str, str], dict[str, str]]:
    """Names of both sides to classes of the comparison, which have our names.

    Raises:
        ConfigError: a pair is malformed or names no class, or no class corresponds.
        NoLabels: one side has no object.
    """
    found = [_without(side, {}) for side in (real, ours)]
    for place, counts in zip((folder, source), found, strict=True):
        if not counts:
            raise errors.NoLabels(
                f"{place}: its labels have no object; expected a folder whose labels name some"
            )
    # COCO and YOLO list classes that need not occur.
    theirs, mine = (
        sorted({*side.category_ids, *counts})
        for side, counts in zip((real, ours), found, strict=True)
    )
    own = {name.casefold(): name for name in mine}
    label_of = {name: own[name.casefold()] for name in theirs if name.casefold() in own}
    given: set[str] = set()
    for pair in classes:
        left, separator, right = pair.partition("=")
        if not separator:
            raise errors.ConfigError(f"--classes {pair}: expected REAL=OURS")
        if left in given:
            raise errors.ConfigError(f"--classes {pair}: '{left}' has a class; expected one each")
        given.add(left)
        for name, known, place in ((left, theirs, folder), (right, mine, source)):
            if name not in known:
                raise errors.ConfigError(
                    f"--classes {pair}: {place} has no class '{name}'; "
                    f"{errors.one_of(name, known)}, as REAL=OURS"
                )
        label_of[left] = right
    if not label_of:
        raise errors.ConfigError(
            f"{folder}: no class agrees with one of {source}; it has "
            f"{errors.list_names(theirs)}, and {source} has "
            f"{errors.list_names(mine)}: name pairs with --classes REAL=OURS"
        )
    seen = {name: label for name, label in label_of.items() if found[0][name] + found[1][label]}
    return seen, {label: label for label in seen.values()}


def _without(side: RealSet, label_of: Mapping[str, str]) -> Counter[str]:
    """Numbers of boxes of classes that are not compared, by name."""
    return Counter(
        thing.name
        for picture in side.pictures
        for thing in picture.objects
        if thing.name not in label_of and not thing.is_ignored
    )


def make_figures(found: CarryOver) -> dict[str, Any]:
    """The comparison as plain JSON values."""
    changes = iter(found.remedies)
    return {
        "source": found.source,
        "folder": str(found.folder),
        "layout": found.real.layout,
        "pictures": {"real": len(found.real.pictures), "ours": len(found.ours.pictures)},
        "skipped": {"real": found.real.skipped, "ours": found.ours.skipped},
        "unmatched": dict(zip(("real", "ours"), found.unmatched, strict=True)),
        "few": found.few,
        "one_sided": found.one_sided,
        "heights": found.heights,
        "rows": [
            asdict(row) | {"change": next(changes) if row.differs else (), "differs": row.differs}
            for row in found.rows
        ],
    }
