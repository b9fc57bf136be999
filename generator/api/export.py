"""Export of a finished data set: the function behind ``gen-data export``."""

import json
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gen_data.api.config import count_workers
from gen_data.api.label_gaps import check_label_gaps
from gen_data.core.errors import ConfigError

if TYPE_CHECKING:
    from gen_data.assemble.config import Config
    from gen_data.runner.progress import RunProgress, Summary

_EXCERPT = re.compile(r"\s+\d*\s*\|")
"""Lines of messages that quote the source."""

Format = str | Mapping[str, Any]
"""Name of an exporter, or its entry of a configuration: ``{"type": "coco", "amodal": False}``."""


def export(  # noqa: PLR0913  (keywords of one front door)
    folder: str | PathLike[str],
    formats: Sequence[Format],
    out: str | PathLike[str],
    *,
    label_map: str | PathLike[str] | None = None,
    workers: int | None = None,
    force: bool = False,
    on_progress: "Callable[[RunProgress], None] | None" = None,
    resume_command: str = "the same call of gen_data.export",
) -> "Summary":
    """Write a finished data set in other formats, without rendering it again.

    The result is another data set, with the same bytes as if it had been generated with these
    exporters. Its images are hard links, or copies on another file system.

    Args:
        folder: A finished data set.
        formats: Exporters, at least one.
        out: Folder of the result.
        label_map: YAML file with a label map, which replaces the data set's.
        workers: Processes; None = one per core, 0 = this process.
        force: Start although the disk is probably too small.
        on_progress: Called after each sample and shard.
        resume_command: Command that error messages give for resuming; empty = there is none.

    Raises:
        StorageError: the folder holds no finished data set, or ``out`` cannot be written.
        ConfigError: a format is unknown, or needs a sensor or an annotation that the data set does
            not have.
        Interrupted: Ctrl-C or SIGTERM; the same call goes on.
        NoLabels: the data set is finished, and the label map leaves no label.
    """
    from gen_data.runner.store import LocalStore

    LocalStore(Path(out)).check_unlocked()

    from gen_data.assemble.config import load_config
    from gen_data.assemble.pipeline_factory import (
        check_scene,
        ready_exporters,
        warn_of_subcategories,
    )
    from gen_data.packs.provision import open_assets
    from gen_data.runner.exports import export as write_exports
    from gen_data.runner.run import Settings
    from gen_data.runner.stored import StoredSamples

    if not formats:
        raise ConfigError("formats: none given; expected at least one exporter, such as coco")
    stored = StoredSamples(folder)
    entries = [{"type": f} if isinstance(f, str) else dict(f) for f in formats]
    overrides = [f"exporters={json.dumps(entries)}"]
    if label_map is not None:
        overrides.append(label_map_override(Path(label_map), stored.categories))
    source = os.fspath(folder)
    with _named_formats():
        config = load_config(source, overrides=overrides, first_scene_only=True)
        _check_annotations(load_config(source, first_scene_only=True), config)
        assets = open_assets(config.asset_folders)
        exporters = ready_exporters(config, stored.info, assets)
        warn_of_subcategories(config, stored.categories, assets)
        check_scene(config, stored.sample(0).scene)
    summary = write_exports(
        stored,
        config,
        exporters,
        Path(out),
        Settings(count_workers(workers), resume_command, on_progress, is_forced=force),
    )
    return check_label_gaps(summary)


@contextmanager
def _named_formats() -> Iterator[None]:
    """Name the formats in errors, rather than the override that they become."""
    try:
        yield
    except ConfigError as error:
        text = re.sub(r"^(\s*)--set:1:\d+: exporters\[", r"\1formats[", str(error), flags=re.M)
        if text == str(error):
            raise
        # The typed text is short, and quoted by the shell: no excerpt.
        kept = [line for line in text.splitlines() if not _EXCERPT.match(line)]
        raise ConfigError("\n".join(kept)) from None


def label_map_override(path: Path, categories: Sequence[str]) -> str:
    """Override of a configuration with the label map of a file.

    Raises:
        ConfigError: the file is not a label map, or has a class that no object of these
            categories can have; the message lists all errors.
    """
    from gen_data.api.relabelling import load_label_map

    label_map = load_label_map(path, {})
    faults = label_map.faults(categories)
    if faults:
        texts = (f"{path}: classes.{name}: {fact}" for name, fact in faults.items())
        raise ConfigError("\n".join(texts))
    return f"labels.map={label_map.model_dump_json(exclude_unset=True)}"


def _check_annotations(made: "Config", wanted: "Config") -> None:
    """Reject exporters that read annotations which the data set was made without."""
    from gen_data.pipeline.exporter_views import needs_of

    exported: set[str] = set().union(*map(needs_of, made.exporters))
    known = {*made.annotations, *exported, *made.general.labels.map.needs}
    for exporter in wanted.exporters:
        missing = sorted(needs_of(exporter) - known)
        if missing:
            raise ConfigError(
                f"exporter '{exporter.type}' reads the annotations {', '.join(missing)}, which the "
                f"data set does not have; add them to its configuration and generate it again"
            )
    missing = sorted(wanted.general.labels.map.needs - known)
    if missing:
        raise ConfigError(
            f"labels.map: its limits read the annotations {', '.join(missing)}, which the data set "
            "does not have; add them to its configuration and generate it again"
        )
