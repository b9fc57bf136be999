"""Rendering of a finished data set's scenes again: the function behind ``gen-data rerender``."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from gen_data.api import config, label_gaps
from gen_data.core.errors import ConfigError, ConfigWarning

if TYPE_CHECKING:
    from gen_data.assemble.config import Config
    from gen_data.runner.progress import RunProgress, Summary
    from gen_data.runner.stored import StoredSamples


def rerender(  # noqa: PLR0913  (keywords of one front door)
    folder: str | PathLike[str],
    out: str | PathLike[str],
    *,
    sensors: str | PathLike[str] | None = None,
    overrides: Sequence[str] = (),
    redraw: Sequence[str] = (),
    workers: int | None = None,
    force: bool = False,
    on_progress: Callable[[RunProgress], None] | None = None,
    resume_command: str = "the same call of gen_data.rerender",
) -> Summary:
    """Render the scenes of a finished data set again with other sensors, weather, light or quality.

    Objects keep their ids, shapes and poses. Randomizers with changed settings are drawn again, all
    others are not: the two data sets are counterfactual pairs. A changed camera without a
    rig keeps its pose; a new one has the pose of the first camera without a rig. Exporters of the
    data set that new sensors do not fit are left out, unless the overrides name exporters.

    Args:
        folder: A finished data set.
        out: Folder of the result.
        sensors: Configuration file whose ``sensors`` replace the data set's.
        overrides: ``KEY=VALUE`` texts, as for ``gen-data --set``. A key may begin with the name of
            a randomizer: ``weather.preset=WetNight``.
        redraw: Names of further randomizers to draw again, because they depend on a changed one.
        workers: Processes; None = one per core, 0 = this process.
        force: Start although the disk is probably too small.
        on_progress: Called after each sample and shard.
        resume_command: Command that error messages give for resuming.

    Raises:
        StorageError: the folder holds no finished data set, or ``out`` cannot be written.
        ConfigError: the change is invalid, or would change the scenes.
        Interrupted: Ctrl-C or SIGTERM; the same call goes on.
        NoLabels: the data set is finished, and no sample has a label.

    Warns:
        ConfigWarning: an exporter of the data set is left out; or a sensor has no label.
    """
    from gen_data.runner.store import LocalStore

    LocalStore(Path(out)).check_unlocked()

    from threadpoolctl import threadpool_limits

    from gen_data.assemble.config import load_config
    from gen_data.runner.rerender import rerender as render_again
    from gen_data.runner.run import Settings
    from gen_data.runner.stored import StoredSamples

    stored, source = StoredSamples(folder), os.fspath(folder)
    was = load_config(source)
    names = {randomizer.name for randomizer in was.probes[0].randomizers}
    texts = [_complete(text, names) for text in overrides]
    if sensors is not None:
        texts.insert(0, _sensors_override(Path(sensors)))
    now = load_config(source, overrides=texts)
    if not any(text.startswith("exporters") for text in texts):
        now = _with_fitting_exporters(now, stored, partial(load_config, source), texts)
    with threadpool_limits(limits=1):
        summary = render_again(
            stored,
            was,
            now,
            Path(out),
            Settings(config.count_workers(workers), resume_command, on_progress, is_forced=force),
            redraw,
        )
    return label_gaps.check_label_gaps(summary)


def _with_fitting_exporters(
    now: Config, stored: StoredSamples, load: Callable[..., Config], overrides: Sequence[str]
) -> Config:
    """The configuration without those inherited exporters that its sensors do not fit.

    Warns:
        ConfigWarning: an exporter is left out; the text has the reason.
    """
    from gen_data.assemble.pipeline_factory import dataset_info, ready_exporters
    from gen_data.packs.provision import open_assets

    if now.general.labels.map.faults(stored.categories):
        return now  # Refused by the run, whatever the exporters are.
    library = open_assets(now.asset_folders)
    info = dataset_info(now, stored.plan.n, stored.categories)
    kept = []
    for exporter, entry in zip(now.exporters, now.resolved["exporters"], strict=True):
        try:
            ready_exporters(replace(now, exporters=(exporter,)), info, library)
            kept.append(entry)
        except ConfigError as error:
            warnings.warn(
                f"{exporter.type} of the data set is left out, as the new sensors do not fit it; "
                f"--set exporters=[...] names the ones that you want\n{error}",
                ConfigWarning,
                stacklevel=3,
            )
    if len(kept) == len(now.exporters):
        return now
    return load(overrides=[*overrides, f"exporters={json.dumps(kept)}"])


def _complete(override: str, randomizers: set[str]) -> str:
    """Complete ``weather.preset=...`` to ``randomizers.weather.preset=...``."""
    name = override.split(".", maxsplit=1)[0]
    return f"randomizers.{override}" if name in randomizers else override


def _sensors_override(path: Path) -> str:
    from gen_data.config.yaml_tree import load_yaml

    listed = load_yaml(path).plain().get("sensors")
    if not listed:
        raise ConfigError(f"{path}: sensors: missing; expected a list of sensors")
    return f"sensors={json.dumps(listed)}"
