"""The content of a report as plain JSON values: ``report.json``, and the data of the HTML page."""

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core import capture, errors, interfaces, system_calls
from gen_data.report import (
    delivery_statistics,
    image_statistics,
    label_checks,
    occupancy_statistics,
    report_tables,
    sample_browser,
)
from gen_data.report.drawn_parameters import DrawnParameters, Parameter, draw_parameters
from gen_data.report.label_files import read_records, read_scans
from gen_data.report.label_gaps import count_objects, find_label_gaps, read_label_map
from gen_data.report.label_statistics import Column, Survey, collect_statistics
from gen_data.report.stored_labels import ObjectStatistics, read_images
from gen_data.runner.layout import LICENCES_NAME, MANIFEST_NAME, RUN_NAME
from gen_data.runner.stored import StoredSamples

BROWSER_BYTES_MAX = 9_000_000
"""Limit of the pictures of a page, shared by its data sets."""
SCENES_DEFAULT = 100
"""Scenes whose parameters are drawn again, chosen evenly."""
GROUPS_MAX = 24
MEMBERS_MAX = 6
THUMBNAIL_PX = 160
BINS_MIN, BINS_MAX = 6, 20
DISCRETE_MAX = 24
"""Parameters with at most this many different values have a bar per value."""
AZIMUTHS, ELEVATIONS = 24, 12
"""Cells of the viewpoint sphere; all have the same area."""
DEVIATION = 1.95
"""Kolmogorov-Smirnov statistics above this value times sqrt(1/n + 1/m) have a chance of 0.1 %."""

Json = dict[str, Any]
Progress = Callable[[str], None]


def describe_folder(folder: Path) -> Json:
    """Statistics of a folder with labels in COCO's or KITTI's format, not of a data set.

    Raises:
        StorageError: no labels are found, or a file does not have the expected layout.
    """
    survey = collect_statistics(read_records(folder))
    tables = (
        *report_tables.make_tables(survey),
        *report_tables.make_scan_tables(tuple(read_scans(folder))),
    )
    return {"name": folder.resolve().name, **_counts(survey), **_statistics(survey, tables)}


def describe_dataset(
    folder: Path,
    *,
    scenes_max: int = SCENES_DEFAULT,
    browser_bytes_max: int = BROWSER_BYTES_MAX,
    progress: Progress = lambda _: None,
) -> Json:
    """Describe a finished data set.

    Labels and images are streamed: per object, 22 numbers stay in memory.

    Args:
        folder: Folder of the data set.
        scenes_max: Number of scenes whose parameters are drawn again; 0 = none.
        browser_bytes_max: Limit of the pictures of the sample browser.
        progress: Called with the name of each step when it begins.

    Raises:
        StorageError: the folder holds no finished data set, or a file is damaged.
    """
    stored = StoredSamples(folder)
    progress("labels")
    objects = ObjectStatistics(stored.info.cameras, stored.categories)
    checks = label_checks.LabelChecks()
    for image in read_images(stored):
        objects.add(image)
        checks.add(image)
    scans = report_tables.make_scan_tables(tuple(read_scans(folder)))
    voxels = occupancy_statistics.count_occupancy(stored).tables()
    made = report_tables.make_tables(objects.survey)
    arrived = delivery_statistics.delivery_tables(stored)
    tables = (*_label_tables(stored), *made, *scans, *voxels, *arrived)
    progress("images")
    files, looks = _measure(stored, objects.splits)
    progress("parameters")
    drawn, problem = _draw(stored, scenes_max)
    progress("sample browser")
    images = sample_browser.browser_images(stored, browser_bytes_max)
    columns = objects.columns()
    return {
        "name": folder.resolve().name,
        "about": _about(stored),
        **_counts(objects.survey),
        "categories": _category_counts(objects, columns),
        **_statistics(objects.survey, tables),
        "labels": [_plain_histogram(h) for h in _label_histograms(objects, columns)],
        "images": [_plain_histogram(h) for h in _image_histograms(files, looks)],
        "viewpoints": _viewpoints(objects, columns),
        "checks": [_plain_check(result) for result in checks.results],
        "duplicates": _plain_duplicates(files, looks),
        "parameters": _plain_parameters(drawn),
        "parameters_note": problem,
        "rejections": _plain_rejections(drawn),
        "rejected_layouts": _manifest(stored)["rejections"],
        "timings": _timings(folder),
        "licences": read_licences(folder / LICENCES_NAME),
        "browser": [{**image.facts, "pictures": image.pictures} for image in images],
    }


def _label_tables(stored: StoredSamples) -> Iterator[report_tables.Table]:
    """Sensors without labels, and the classes of exports, if they are not the categories."""
    gaps = tuple((line,) for line in find_label_gaps(stored).lines())
    if gaps:
        yield report_tables.Table("Without labels", ("what",), gaps)
    classes = read_label_map(stored.config).classes_of
    if classes:
        counts = count_objects(stored)
        rows = [(name, str(counts[name]), ", ".join(own)) for name, own in classes.items()]
        note = "Visible objects in all images, before the limits of the label map."
        yield report_tables.Table(
            "Exported classes", ("class", "objects", "categories"), tuple(rows), note
        )


def without_pictures(report: Json) -> Json:
    """The report without ``data:`` URLs, points and lines, for ``report.json``."""

    def strip(value: Any) -> Any:
        if isinstance(value, dict):
            dropped = ("pictures", *sample_browser.DRAWN)
            left = {k: strip(v) for k, v in value.items() if k not in dropped}
            return left | ({"picture": ""} if "picture" in left else {})
        return [strip(item) for item in value] if isinstance(value, list) else value

    stripped: Json = strip(report)
    return stripped


def _about(stored: StoredSamples) -> Json:
    info = stored.info
    per_scene = info.views_per_scene * info.steps_per_scene
    return {
        "configuration": stored.plan.name,
        "template": str(stored.config.get("template", "")),
        "dataset_id": stored.dataset_id,
        "version": str(stored.plan.versions.get("gen-data", "")),
        "seed": info.seed,
        "samples": stored.n,
        "scenes": len({index // per_scene for index in stored.indices}),
        "views_per_scene": info.views_per_scene,
        "steps_per_scene": info.steps_per_scene,
        "sensors": [
            f"{s.name}: {', '.join(c.value for c in s.channels) or s.kind or s.modality.value}"
            for s in info.sensors
        ],
        "bytes": _manifest(stored)["bytes"],
    }


def _manifest(stored: StoredSamples) -> Json:
    manifest: Json = json.loads((stored.folder / MANIFEST_NAME).read_bytes())
    return manifest


def _counts(survey: Survey) -> Json:
    splits: dict[str, int] = {}
    for split, _ in survey.images:
        splits[split] = splits.get(split, 0) + 1
    total = {"images": len(survey.images), "objects": sum(survey.images.values())}
    return {"counts": total, "splits": splits}


def _statistics(survey: Survey, tables: Iterable[report_tables.Table]) -> Json:
    return {
        "tables": [asdict(table) for table in tables],
        "histograms": [_plain_histogram(h) for h in report_tables.make_histograms(survey)],
    }


def _category_counts(objects: ObjectStatistics, columns: Mapping[str, Column]) -> list[Json]:
    """Objects, and images with them, by category; also categories without objects."""
    rows = []
    place = columns["index"] * len(objects.cameras) + columns["camera"]
    for number, name in enumerate(objects.categories):
        own = columns["category"] == number
        images = int(np.unique(place[own]).size)
        rows.append({"name": name, "objects": int(own.sum()), "images": images})
    return rows


def _label_histograms(
    objects: ObjectStatistics, columns: Mapping[str, Column]
) -> tuple[report_tables.Histogram, ...]:
    areas = [0, 8, 16, 32, 64, 96, 128, 192, 256, 384, 512, 1024]
    points = [0, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000]
    shares = np.linspace(0.0, 1.0, 11)
    side_px = np.sqrt(columns["width_px"] * columns["height_px"])
    by_name = (
        ("Size of the box: square root of its area [px]", np.array(areas, float), side_px),
        ("Occlusion", shares, columns["occlusion"]),
        ("Truncation", shares, columns["truncation"]),
        ("Laser points on an object", np.array(points, float), columns["lidar_points"]),
    )
    made = []
    for title, edges, column in by_name:
        split = {
            name: column[columns["category"] == number]
            for number, name in enumerate(objects.categories)
        }
        made.append(report_tables.count_values(title, edges, split))
    return tuple(h for h in made if any(counts.any() for counts in h.counts.values()))


def _image_histograms(
    files: Sequence[image_statistics.ImageFile], looks: Sequence[image_statistics.Look]
) -> list[report_tables.Histogram]:
    cameras = np.array([file.camera for file in files])
    made = []
    for title, values, top in (
        ("Brightness of an image: mean grey value", [look.brightness for look in looks], 1.0),
        (
            "Contrast of an image: standard deviation of grey values",
            [x.contrast for x in looks],
            0.5,
        ),
    ):
        column = np.array(values, float)
        split = {str(name): column[cameras == name] for name in np.unique(cameras)}
        made.append(report_tables.count_values(title, np.linspace(0.0, top, 21), split))
    return made


def _measure(
    stored: StoredSamples, splits: Mapping[int, str]
) -> tuple[list[image_statistics.ImageFile], list[image_statistics.Look]]:
    info = stored.info
    per_scene = info.views_per_scene * info.steps_per_scene
    files = []
    for index in stored.indices:
        folder = stored.shard_dir(index // stored.plan.shard_size)
        for camera, channels in info.media.items():
            path = interfaces.media_path(folder, camera, capture.Channel.RGB, index)
            # A camera with a lower rate has no image at most steps.
            if capture.Channel.RGB in channels and path.is_file():
                files.append(
                    image_statistics.ImageFile(
                        index, camera, index // per_scene, splits.get(index, ""), path
                    )
                )
    workers = system_calls.usable_cores()
    return files, [look for _, look in image_statistics.measure_images(files, workers)]


def _viewpoints(objects: ObjectStatistics, columns: Mapping[str, Column]) -> Json:
    """Directions of the camera seen from objects, counted in cells of equal area, by category."""
    azimuth = columns["azimuth_rad"]
    height = np.sin(columns["elevation_rad"])
    edges = (np.linspace(-math.pi, math.pi, AZIMUTHS + 1), np.linspace(-1.0, 1.0, ELEVATIONS + 1))
    counts = {}
    for number, name in enumerate(objects.categories):
        own = (columns["category"] == number) & np.isfinite(azimuth)
        if own.any():
            table = np.histogram2d(azimuth[own], height[own], edges)[0]
            counts[name] = table.astype(int).tolist()
    return {"azimuths": AZIMUTHS, "elevations": ELEVATIONS, "counts": counts}


def _plain_histogram(histogram: report_tables.Histogram) -> Json:
    counts = {name: c.tolist() for name, c in histogram.counts.items() if c.any()}
    return {"title": histogram.title, "edges": histogram.edges.tolist(), "counts": counts}


def _plain_check(result: label_checks.CheckResult) -> Json:
    return {**asdict(result), "examples": [asdict(example) for example in result.examples]}


def _plain_duplicates(
    files: Sequence[image_statistics.ImageFile], looks: Sequence[image_statistics.Look]
) -> Json:
    groups = image_statistics.group_duplicates(files, [look.hash for look in looks])

    def plain(group: image_statistics.DuplicateGroup) -> Json:
        shown = [files[k] for k in group.members[:MEMBERS_MAX]]
        members = [
            {
                "index": file.index,
                "camera": file.camera,
                "picture": sample_browser.thumbnail(file.path, THUMBNAIL_PX),
            }
            for file in shown
        ]
        return {
            "images": len(group.members),
            "scenes": group.scenes,
            "splits": list(group.splits),
            "members": members,
        }

    return {
        "images": len(files),
        "bits": image_statistics.DISTANCE_MAX,
        "groups": len(groups),
        "grouped": sum(len(group.members) for group in groups),
        "shown": [plain(group) for group in groups[:GROUPS_MAX]],
    }


def _draw(stored: StoredSamples, scenes_max: int) -> tuple[DrawnParameters | None, str]:
    """Drawn parameters, and a note on them; None where they cannot be repeated."""
    if not scenes_max:
        return None, "Not drawn again: --scenes 0."
    if stored.plan.scenes_of:
        return None, "The scenes of another data set were rendered again: see its report."
    try:
        drawn = draw_parameters(stored, scenes_max)
    except errors.GenDataError as error:
        return None, f"Parameters cannot be drawn again on this machine: {error}"
    note = (
        f"Every draw of {drawn.scenes} scenes, chosen evenly, and of all their views; values that "
        "a randomizer drew and discarded, such as places that were taken, are included."
    )
    if drawn.different:
        note += (
            f" {drawn.different} of these scenes differ from the stored ones, which another "
            "version of gen-data or of a library made: values may differ."
        )
    return drawn, note


def _plain_rejections(drawn: DrawnParameters | None) -> list[Json]:
    if drawn is None:
        return []
    ordered = sorted(drawn.rejections.items(), key=lambda item: (-item[1], item[0]))
    return [{"reason": r, "remedy": remedy, "count": n} for (r, remedy), n in ordered]


def _plain_parameters(drawn: DrawnParameters | None) -> list[Json]:
    if drawn is None:
        return []
    return [row for parameter in drawn.parameters for row in _describe_parameter(parameter)]


def _describe_parameter(parameter: Parameter) -> list[Json]:
    """Histograms of a parameter; one per component of a vector."""
    if any(isinstance(value, (tuple, list)) for value in parameter.values):
        drawn, expected = np.array(parameter.values), np.array(parameter.expected)
        return [
            _compare_numbers(parameter, f"{parameter.name}[{k}]", drawn[:, k], expected[:, k])
            for k in range(drawn.shape[1])
        ]
    names = {_name(v) for v in (*parameter.values, *parameter.expected)}
    numeric = all(type(v) in (int, float) for v in parameter.expected)
    if not numeric or len(names) <= DISCRETE_MAX:
        return [_compare_names(parameter, numeric)]
    drawn, expected = np.array(parameter.values, float), np.array(parameter.expected, float)
    return [_compare_numbers(parameter, parameter.name, drawn, expected)]


def _compare_names(parameter: Parameter, numeric: bool) -> Json:
    values = {*parameter.values, *parameter.expected}
    ordered = sorted(values) if numeric else sorted(values, key=_name)
    names = list(dict.fromkeys(map(_name, ordered)))
    places = {name: place for place, name in enumerate(names)}
    rows = {
        key: np.bincount([places[_name(v)] for v in column], minlength=len(names))
        for key, column in (("drawn", parameter.values), ("expected", parameter.expected))
    }
    steps = [np.cumsum(row / row.sum()) for row in rows.values()]
    deviation = float(np.abs(steps[0] - steps[1]).max())
    return _plain_parameter(parameter, parameter.name, rows, deviation) | {"names": names}


def _compare_numbers(parameter: Parameter, name: str, drawn: Column, expected: Column) -> Json:
    low, high = parameter.limits or (
        float(min(drawn.min(), expected.min())),
        float(max(drawn.max(), expected.max())),
    )
    # Fewer draws have wider bins, of about ten draws each.
    bins = int(np.clip(len(drawn) // 10, BINS_MIN, BINS_MAX))
    edges = np.linspace(low, high if high > low else low + 1.0, bins + 1)
    rows = {"drawn": np.histogram(drawn, edges)[0], "expected": np.histogram(expected, edges)[0]}
    ends = np.sort(np.concatenate([drawn, expected]))
    steps = [np.searchsorted(np.sort(c), ends, "right") / len(c) for c in (drawn, expected)]
    deviation = float(np.abs(steps[0] - steps[1]).max())
    return _plain_parameter(parameter, name, rows, deviation) | {"edges": edges.tolist()}


def _plain_parameter(
    parameter: Parameter, name: str, rows: Mapping[str, NDArray[np.intp]], deviation: float
) -> Json:
    n, m = int(rows["drawn"].sum()), int(rows["expected"].sum())
    limit = DEVIATION * math.sqrt(1.0 / n + 1.0 / m)
    return {
        "name": name,
        "declared": dict(parameter.declared),
        "draws": n,
        "deviation": round(deviation, 4),
        "limit": round(limit, 4),
        "drawn": rows["drawn"].tolist(),
        "expected": (rows["expected"] / m).round(6).tolist(),
    }


def _name(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _timings(folder: Path) -> Json:
    """CPU seconds per sample by stage, of the last run that generated samples; empty if unknown."""
    path = folder / RUN_NAME / "log.jsonl"
    latest: Json = {}
    if path.is_file():
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                latest = json.loads(line).get("cpu_s_per_sample") or latest
            except (ValueError, AttributeError):
                # The last line of a run that was killed may be incomplete.
                continue
    return {stage: float(seconds) for stage, seconds in latest.items()}


def read_licences(path: Path) -> list[Json]:
    """Rows of the table in ``LICENSES-ASSETS.md``; none without the file."""
    if not path.is_file():
        return []
    rows = [
        [cell.strip() for cell in line.strip().strip("|").split(" | ")]
        for line in path.read_text(encoding="utf-8").splitlines()
        if line.startswith("| ")
    ]
    keys = ("source", "licence", "author", "assets")
    # Only the last column may hold the separator.
    cells = ([*row[:3], " | ".join(row[3:])] for row in rows[1:])
    return [dict(zip(keys, row, strict=False)) for row in cells]
