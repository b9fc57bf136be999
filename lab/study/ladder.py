"""Ladders: the same scenes at several steps of one factor, and the AP of a detector at each step.

Sample ``i`` of every step has the same seed and index, so all draws but the factor's agree, as far
as the factor permits; differences between steps are paired by picture.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from gen_data.api.config import load_config
from gen_data.api.generate import generate
from gen_data.api.open_dataset import open_dataset
from gen_data.config.yaml_scalars import to_flow_yaml
from gen_data.core.errors import ConfigError, StorageError
from gen_data.lab.study import study
from gen_data.lab.study.evaluation import evaluate, read_results
from gen_data.lab.study.findings import Table
from gen_data.lab.study.real_pictures import check_judges, read_real

INDEX = "ladder.json"
ONE_SPLIT = "splits={train: 0, val: 0, test: 1}"
"""Steps are data to judge by; one split has all indices."""


@dataclass(frozen=True)
class Ladder:
    """Steps of one factor.

    Attributes:
        factor: Field of the configuration, as for ``--set``.
        values: Its value at each step, as YAML.
    """

    factor: str
    values: tuple[str, ...]

    def folder(self, out: Path, step: int) -> Path:
        """Folder of the data set of a step."""
        return out / f"step_{step:02d}"


def parse_factor(text: str, steps: int) -> Ladder:
    """Read ``FIELD=LOW..HIGH``, evenly divided into steps, or ``FIELD=[value, value, ...]``.

    Raises:
        ConfigError: it is neither, or has fewer than two steps.
    """
    field, equals, given = text.partition("=")
    low, dots, high = given.partition("..")
    try:
        if not equals or not field:
            listed = None
        elif dots:
            listed = np.linspace(float(low), float(high), max(steps, 0)).round(9).tolist()
        else:
            listed = yaml.safe_load(given)
    except (ValueError, yaml.YAMLError):
        listed = None
    values = tuple(dict.fromkeys(map(to_flow_yaml, listed))) if isinstance(listed, list) else ()
    if len(values) < 2:
        raise ConfigError(
            f"--factor: '{text}' with {steps} steps; expected FIELD=LOW..HIGH or "
            "FIELD=[value, value, ...], and at least two different values"
        )
    return Ladder(field, values)


def build(
    config: Any,
    ladder: Ladder,
    n: int,
    out: Path,
    *,
    workers: int | None = None,
    report: Callable[[str], None],
) -> list[int]:
    """Generate the data set of every step, or the missing samples of them.

    Returns:
        Samples of each step whose objects stand where they stand at the first step.

    Raises:
        ConfigError: the factor is not a field, a value is impossible, or no step writes COCO.
        StorageError: the folder holds another ladder.
    """
    facts = {"factor": ladder.factor, "values": list(ladder.values), "config": str(config), "n": n}
    index = out / INDEX
    if index.exists() and _read_index(out) != facts:
        raise StorageError(f"{out}: holds another ladder; choose another folder")
    overrides = [[f"{ladder.factor}={value}", ONE_SPLIT] for value in ladder.values]
    for changed in overrides:  # All steps are valid before the first one is generated.
        exporters = load_config(config, overrides=changed).exporters
        if not any(exporter.type == "coco" for exporter in exporters):
            raise ConfigError(
                f"{config}: exporters: a ladder needs {{type: coco}}, to be judged by"
            )
    out.mkdir(parents=True, exist_ok=True)
    index.write_text(json.dumps(facts, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    folders = [ladder.folder(out, step) for step in range(len(overrides))]
    for step, (folder, changed) in enumerate(zip(folders, overrides, strict=True)):
        report(f"step {step}: {changed[0]}")
        generate(
            config,
            n,
            out=folder,
            workers=workers,
            overrides=changed,
            resume_command="the same command",
        )
    return _count_same(folders)


def judge(out: Path, pattern: str) -> dict[str, Any]:
    """Compare COCO results of one detector at all steps of a ladder.

    Args:
        out: Folder of the ladder.
        pattern: Path of the files of results, with ``{step}`` in the place of a step's number.

    Returns:
        Findings as of a study, whose variants are the steps; the first one is the baseline.
    """
    if "{step}" not in pattern:
        raise ConfigError(f"--results: '{pattern}'; expected a path with {{step}} in it")
    ladder, runs = read_ladder(out), {}
    for step, value in enumerate(ladder.values):
        pictures = read_real(ladder.folder(out, step) / "coco")
        check_judges(pictures)
        found = read_results(Path(pattern.replace("{step}", str(step))), pictures)
        runs[f"{ladder.factor}={value}"] = [evaluate(pictures, found)]
    return study.write_findings(runs, pictures, out, f"Ladder of {ladder.factor}")


def read_ladder(out: Path) -> Ladder:
    """The ladder of a folder. Raises StorageError if there is none."""
    facts = _read_index(out)
    return Ladder(facts["factor"], tuple(facts["values"]))


def _read_index(out: Path) -> dict[str, Any]:
    try:
        facts: dict[str, Any] = json.loads((out / INDEX).read_text("utf-8"))
        facts["factor"], facts["values"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StorageError(f"{out}: no ladder ({INDEX}); make one with --factor") from error
    return facts


def table_of(ladder: Ladder, same: Sequence[int], n: int) -> Table:
    """Steps, and how many of their scenes are the same as at the first step."""
    rows = [
        [str(step), value, f"{count} of {n}"]
        for step, (value, count) in enumerate(zip(ladder.values, same, strict=True))
    ]
    header = ["step", ladder.factor, "scenes with objects at the same poses"]
    return {"title": "ladder", "header": header, "rows": rows, "note": ""}


def _count_same(folders: Sequence[Path]) -> list[int]:
    """Samples of each data set whose objects stand as in the first one, which is read once."""
    poses = []
    for folder in folders:
        with open_dataset(folder) as samples:
            poses.append([_poses(sample) for sample in samples])
    return [sum(a == b for a, b in zip(poses[0], other, strict=True)) for other in poses]


def _poses(sample: Any) -> list[tuple[str, Any]]:
    return [(i.asset, i.T_world_instance) for i in sample.scene.instances]
