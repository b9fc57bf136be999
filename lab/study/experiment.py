"""Runs of an experiment: data, training and detections of every variant and seed, resumable.

A folder holds one experiment. Each run writes its detections last and in one step: a run is either
done or repeated. Data sets resume by themselves, and trainings take minutes.
"""

import hashlib
import json
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from gen_data.api.config import load_config
from gen_data.api.dataset import Dataset
from gen_data.api.generate import generate
from gen_data.core import distribution, serialization, streams, system_calls
from gen_data.core.errors import ConfigError, SampleError, StorageError, list_names
from gen_data.core.processes import SINGLE_THREADED, interrupts_blocked, tie
from gen_data.lab.study.real_pictures import RealPicture, RealSet, check_judges, read_real
from gen_data.runner.durable_files import write_durably

BASELINE = "baseline"
PLAN, RESULTS, TASK, LOG = "study.json", "results.json", "task.json", "training.log"
_DATA_OVERRIDES = ("splits={train: 1, val: 0, test: 0}", "exporters=[]")
"""Detectors are judged on real pictures: every sample trains, and no other format is read."""


@dataclass(frozen=True)
class Variant:
    """One configuration of an experiment.

    Attributes:
        name: As in tables.
        config: A path or a shipped name.
        overrides: ``KEY=VALUE`` texts.
        without: Names of randomizers that are left out.
        real: Number of real pictures that are added to the training.
    """

    name: str
    config: str
    overrides: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    real: int = 0


@dataclass(frozen=True)
class Experiment:
    """Compared variants, and the pictures that compare them.

    Attributes:
        folder: Folder of real pictures.
        split: Part of the name of COCO's annotation file; empty = the only one, or ``val``.
        variants: The first one is the baseline.
        n: Samples of each data set.
        seeds: Repetitions; each has its own data, real training pictures and weights.
        steps: Training steps of ``batch`` pictures.
        size_px: Longest side of the detector's input.
    """

    folder: Path
    variants: tuple[Variant, ...]
    split: str = ""
    n: int = 400
    seeds: int = 3
    steps: int = 800
    batch: int = 8
    size_px: int = 256

    def real_count(self) -> int:
        """Real pictures that are kept from judging, because a variant may train on them."""
        return max(variant.real for variant in self.variants)


@dataclass(frozen=True)
class Prepared:
    """An experiment whose input was checked.

    Attributes:
        classes: Classes of the detector, in order.
        real: Real pictures with the objects of these classes.
    """

    experiment: Experiment
    classes: tuple[str, ...]
    real: RealSet

    def training_pictures(self, count: int, seed: int) -> tuple[RealPicture, ...]:
        """The first of the pictures that are kept for training, in an order drawn by the seed."""
        kept, _ = self._divide()
        order = streams.Streams(seed, 0).rng("study/training").permutation(len(kept))
        return tuple(kept[number] for number in order[:count])

    def judged_pictures(self) -> tuple[RealPicture, ...]:
        """The pictures that every run is judged by: no variant trains on any of them."""
        return self._divide()[1]

    def _divide(self) -> tuple[tuple[RealPicture, ...], tuple[RealPicture, ...]]:
        pictures, count = self.real.pictures, self.experiment.real_count()
        order = streams.Streams(0, 0).rng("study/kept").permutation(len(pictures))
        chosen = set(order[:count].tolist())
        numbered = list(enumerate(pictures))
        return (
            tuple(picture for number, picture in numbered if number in chosen),
            tuple(picture for number, picture in numbered if number not in chosen),
        )


@dataclass(frozen=True)
class Run:
    """One variant with one seed.

    Attributes:
        folder: Folder of its detector and detections.
        data: Folder of the data set that it trains on, which equal configurations share.
    """

    variant: Variant
    seed: int
    folder: Path
    data: Path

    @property
    def is_done(self) -> bool:
        """Whether its detections are there."""
        return (self.folder / RESULTS).is_file()

    def results(self) -> list[dict[str, Any]]:
        """Its detections in COCO's format of results."""
        rows: list[dict[str, Any]] = json.loads((self.folder / RESULTS).read_text("utf-8"))
        return rows


def require_torch(command: str) -> None:
    """Raise ConfigError with the remedy if torch, which the small detector needs, is missing.

    The extra ``all`` leaves it out: it is larger than everything else together.
    """
    if find_spec("torch") is None:
        raise ConfigError(
            f"{command} needs the package torch: {distribution.install_command('study')}"
        )


def prepare(experiment: Experiment) -> Prepared:
    """Check configurations and pictures, before anything takes long.

    Raises:
        ConfigError: a configuration or number is wrong, or configurations have other classes.
        StorageError: a label file does not have the expected layout.
    """
    for name in ("n", "seeds", "steps", "batch", "size_px"):
        if getattr(experiment, name) < 1:
            raise ConfigError(f"{name}: {getattr(experiment, name)}; expected at least 1")
    real = read_real(experiment.folder, experiment.split)
    classes = _classes(experiment.variants[0])
    for variant in experiment.variants[1:]:
        if set(_classes(variant)) - set(classes):
            strange = sorted(set(_classes(variant)) - set(classes))
            raise ConfigError(
                f"variant '{variant.name}': has the classes {list_names(strange)}, which the "
                "baseline lacks; expected the same classes: give both the same labels.map"
            )
    restricted = real.restrict(classes)
    check_judges(restricted)
    count = experiment.real_count()
    if count and count > len(real.pictures) // 2:
        raise ConfigError(
            f"{experiment.folder}: has {len(real.pictures)} pictures, of which {count} would "
            f"train; expected at most {len(real.pictures) // 2}: the others judge"
        )
    return Prepared(experiment, classes, restricted)


def list_runs(prepared: Prepared, out: Path) -> list[Run]:
    """All runs, the first seed first: an unfinished experiment compares all variants."""
    variants = prepared.experiment.variants
    settings = [(v.config, v.overrides, v.without) for v in variants]
    return [
        Run(
            variant,
            seed,
            out / "runs" / f"{number:02d}-{seed}",
            out / "data" / f"{settings.index(settings[number]):02d}-{seed}",
        )
        for seed in range(prepared.experiment.seeds)
        for number, variant in enumerate(variants)
    ]


def perform(
    prepared: Prepared, out: Path, workers: int | None, report: Callable[[str], None]
) -> list[Run]:
    """Perform all runs that are missing.

    Args:
        prepared: The experiment.
        out: Its folder.
        workers: Processes that generate, or train; None = one per core.
        report: Called with a line on every step.

    Raises:
        StorageError: the folder holds another experiment.
        GenDataError: a data set cannot be generated, or a training fails.
    """
    _claim(prepared, out)
    runs = list_runs(prepared, out)
    missing = [run for run in runs if not run.is_done]
    if len(missing) < len(runs):
        report(f"{len(runs) - len(missing)} of {len(runs)} runs were done before")
    count = system_calls.usable_cores() if workers is None else max(workers, 1)
    for first in range(0, len(missing), count):
        together = missing[first : first + count]
        for run in together:
            _generate(prepared, run, workers, report)
        _train(prepared, together, report)
        needed = {run.data for run in runs if not run.is_done}
        for data in {run.data for run in together} - needed:
            shutil.rmtree(data)
    return runs


def _classes(variant: Variant) -> tuple[str, ...]:
    with Dataset(variant.config, overrides=variant.overrides, without=variant.without) as samples:
        has_map = bool((samples.config.get("labels") or {}).get("map"))
        return (samples.relabelled() if has_map else samples).categories


def _claim(prepared: Prepared, out: Path) -> None:
    """Write the purpose of the folder; refuse a folder of another experiment."""
    experiment = prepared.experiment
    stated = {
        **{key: value for key, value in asdict(experiment).items() if key != "folder"},
        "variants": [
            asdict(variant) | {"digest": _digest(variant)} for variant in experiment.variants
        ],
        "classes": list(prepared.classes),
        "pictures": hashlib.sha256(
            serialization.canonical_json([
                [p.image_id, p.path.name, p.size_px, [asdict(thing) for thing in p.objects]]
                for p in prepared.real.pictures
            ]).encode()
        ).hexdigest(),
    }  # fmt: skip
    path = out / PLAN
    text = json.dumps(stated, indent=1, sort_keys=True) + "\n"
    if path.is_file():
        if path.read_text("utf-8") != text:
            raise StorageError(
                f"{out}: holds a study with other variants, settings or pictures; choose another "
                "folder with --out, or delete it"
            )
        return
    try:
        out.mkdir(parents=True, exist_ok=True)
        write_durably(path, text.encode(), out)
    except OSError as error:
        raise StorageError(f"{out}: {error.strerror}") from error


def _digest(variant: Variant) -> str:
    loaded = load_config(variant.config, overrides=variant.overrides, without=variant.without)
    return hashlib.sha256(serialization.canonical_json(loaded.resolved).encode()).hexdigest()


def _generate(
    prepared: Prepared, run: Run, workers: int | None, report: Callable[[str], None]
) -> None:
    """Generate the data set of a run; one that is there is finished at once."""
    variant, started_s = run.variant, time.monotonic()
    loaded = load_config(variant.config, overrides=variant.overrides, without=variant.without)
    generate(
        variant.config,
        prepared.experiment.n,
        out=run.data,
        workers=workers,
        seed=loaded.general.seed + run.seed,
        overrides=(*variant.overrides, *_DATA_OVERRIDES),
        without=variant.without,
        resume_command="the same command",
    )
    spent_s = time.monotonic() - started_s
    report(f"{variant.name}, seed {run.seed}: {prepared.experiment.n} samples in {spent_s:.0f} s")


def _train(prepared: Prepared, runs: Sequence[Run], report: Callable[[str], None]) -> None:
    started_s = time.monotonic()
    with _processes([_write_task(prepared, run) for run in runs]) as processes:
        for run, process in zip(runs, processes, strict=True):
            if process.wait() != 0 or not run.is_done:
                lines = (run.folder / LOG).read_text("utf-8", "replace").splitlines()
                raise SampleError(
                    f"variant '{run.variant.name}', seed {run.seed}: the training failed with "
                    f"status {process.returncode}: {lines[-1] if lines else 'no message'} "
                    f"(all of it is in {run.folder / LOG})"
                )
            spent_s = time.monotonic() - started_s
            report(f"{run.variant.name}, seed {run.seed}: trained in {spent_s:.0f} s")


def _write_task(prepared: Prepared, run: Run) -> Path:
    experiment = prepared.experiment
    task = {
        "data": str(run.data),
        "folder": str(experiment.folder),
        "split": experiment.split,
        "classes": list(prepared.classes),
        "training": [p.image_id for p in prepared.training_pictures(run.variant.real, run.seed)],
        "judged": [p.image_id for p in prepared.judged_pictures()],
        "steps": experiment.steps,
        "batch": experiment.batch,
        "size_px": experiment.size_px,
        "seed": run.seed,
    }
    path = run.folder / TASK
    path.parent.mkdir(parents=True, exist_ok=True)
    write_durably(path, (json.dumps(task, indent=1) + "\n").encode(), run.folder)
    return path


@contextmanager
def _processes(tasks: Sequence[Path]) -> Iterator[list[subprocess.Popen[bytes]]]:
    threads: Mapping[str, str] = dict.fromkeys(SINGLE_THREADED, "1")
    running: list[subprocess.Popen[bytes]] = []
    try:
        for task in tasks:
            command = [sys.executable, "-m", "gen_data.lab.study.run_training", str(task)]
            with task.with_name(LOG).open("wb") as log, interrupts_blocked():
                running.append(
                    subprocess.Popen(tie(command, threads), stdout=log, stderr=subprocess.STDOUT)
                )
        yield running
    finally:
        for process in running:
            process.kill()
            process.wait()
