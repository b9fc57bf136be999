"""Fit of a configuration to recordings: the function behind ``gen-data match``."""

import json
import re
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING

from gen_data.core.errors import ConfigError, StorageError
from gen_data.core.whole_files import check_new, write_whole

if TYPE_CHECKING:
    from collections.abc import Callable

    from gen_data.lab.matching.results import Match


def match(  # noqa: PLR0913  (keywords of one front door)
    folder: str | PathLike[str],
    config: str | PathLike[str],
    out: str | PathLike[str] = "matched.yaml",
    *,
    images: int = 200,
    scans: int = 60,
    scenes: int = 48,
    camera: str = "",
    lidar: str = "",
    force: bool = False,
    on_progress: "Callable[[str], None] | None" = None,
) -> "Match":
    """Fit the sensors of a configuration to a folder of unlabelled recordings.

    Exposure, tone, colour, noise, blur and JPEG quality are fitted to photographs; reflectance,
    dropout and range to laser scans; distance and pitch of the camera to boxes, if the folder has
    labels of COCO or KITTI. docs/match.md explains the estimates and their limits.

    Args:
        folder: Holds photographs, scans (``.bin``, ``.pcd``, ``.ply``) and labels at any depth.
        config: A YAML file or a shipped name.
        out: The configuration to write, which extends ``config``; a ``.json`` and an ``.html`` file
            next to it have the report.
        images: Largest number of photographs to read, chosen evenly.
        scans: Largest number of scans to read, chosen evenly.
        scenes: Number of scenes of the configuration to simulate.
        camera: Camera to fit; empty = the first.
        lidar: Laser scanner to fit; empty = the first.
        force: Replace files that exist.
        on_progress: Called with the name of each step when it begins.

    Returns:
        The fitted values with intervals, statistics before and after, and the files that were read.

    Raises:
        ConfigError: the configuration is wrong, or an argument.
        StorageError: the folder holds nothing that can be read, or a file exists or cannot be
            written, which is found before the fit.
    """
    from threadpoolctl import threadpool_limits

    from gen_data.lab.matching.match import match_recordings
    from gen_data.lab.matching.match_report import format_match_page, make_figures
    from gen_data.lab.matching.matched_yaml import format_config

    path, source = Path(out), fspath(config)
    if path.suffix != ".yaml":
        raise ConfigError(f"--out: {path}; expected a name that ends in .yaml")
    if Path(source).is_dir():
        raise ConfigError(f"{source}: is a folder; expected a configuration to extend")
    if path.resolve() == Path(source).resolve():
        raise ConfigError(f"--out: {path} is the configuration itself; choose another name")
    targets = [path, path.with_suffix(".json"), path.with_suffix(".html")]
    check_new(targets, force=force)
    with threadpool_limits(limits=1):
        found = match_recordings(
            Path(folder),
            source,
            images=images,
            scans=scans,
            scenes=scenes,
            camera=camera,
            lidar=lidar,
            progress=on_progress or (lambda _: None),
        )
    figures = json.dumps(make_figures(found), ensure_ascii=False, indent=1, allow_nan=False)
    text = format_config(found, path)
    _refuse_invalid(text, path, source)
    texts = [text, figures + "\n", format_match_page(found, Path(source).stem)]
    try:
        write_whole({k: text.encode() for k, text in zip(targets, texts, strict=True)})
    except OSError as error:
        raise StorageError(f"{error.filename}: {error.strerror}; choose another --out") from error
    return found


def _refuse_invalid(text: str, path: Path, source: str) -> None:
    """Refuse a configuration that could not be read back, before it is written.

    Raises:
        ConfigError: the message names the fitted configuration and its fields.
        StorageError: there can be no folder for it.
    """
    from gen_data.assemble.config import parse_config

    try:
        path.parent.mkdir(parents=True, exist_ok=True)  # Relative paths start from it.
        parse_config(text, str(path), path.stem)
    except OSError as error:
        raise StorageError(f"{error.filename}: {error.strerror}; choose another --out") from error
    except ConfigError as error:
        reason = re.sub(rf"^{re.escape(str(path))}:\d+:\d+: ", "", str(error), flags=re.MULTILINE)
        raise ConfigError(
            f"{source}: nothing is written, as its fitted fields are refused: {reason}"
        ) from None
