"""CPU time of exporters: ``python -m benchmarks.bench_exporters FOLDER [FORMAT ...]``.

FOLDER is a finished data set. Prints CPU milliseconds per sample of ``write_shard`` and of
``finalize`` for each format alone: the listed ones, or all formats to which the data set can be
exported. Formats with options are written as YAML, such as ``'{type: voc, images: png}'``. Samples
are read before the measurement, and each format is measured ``--repeat`` times; the minimum counts.
"""

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import ready_exporters
from gen_data.assets.library import open_library
from gen_data.core.errors import ConfigError
from gen_data.core.sample import Sample
from gen_data.exporters import TABLE
from gen_data.runner import exports, shard
from gen_data.runner.stored import CheckedSamples, StoredSamples


def measure(folder: Path, entry: dict[str, Any], n: int) -> tuple[float, float]:
    """CPU seconds of one format: of writing a shard of ``n`` samples, and of merging it.

    Raises:
        ConfigError: the data set cannot be exported in this format.
    """
    stored = CheckedSamples(folder)
    config = load_config(str(folder), overrides=[f"exporters={json.dumps([entry])}"])
    exporters = ready_exporters(config, stored.info, open_library(config.asset_folders))
    ((name, exporter),) = exporters.items()
    missing = exporter.needs - frozenset(config.annotations)
    if missing:
        raise ConfigError(f"the data set lacks annotations: {', '.join(sorted(missing))}")
    pipeline = exports.StoredPipeline(stored, exporters, config.asset_folders)
    files = exports.LinkedFiles(stored)
    with tempfile.TemporaryDirectory(dir=folder.parent) as scratch:
        shard_dir, merged = Path(scratch) / "shard", Path(scratch) / name
        samples: list[Sample] = []
        for index in range(n):
            sample = pipeline.sample(index)
            files.link_media(stored.info, sample, shard_dir)
            samples.append(shard.drop_pixels(sample))
        started_s = time.process_time()
        exporter.write_shard(stored.info, samples, shard_dir)
        written_s = time.process_time()
        exporter.finalize(stored.info, [shard_dir], merged)
        return written_s - started_s, time.process_time() - written_s


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("formats", nargs="*", default=sorted(TABLE))
    parser.add_argument("--n", type=int, default=20)
    parser.add_argument("--repeat", type=int, default=3)
    args = parser.parse_args()
    n = min(args.n, StoredSamples(args.folder).n)
    print(f"{'CPU ms per sample':<24} {'write':>8} {'merge':>8}")
    for text in args.formats:
        entry = yaml.safe_load(text)
        entry = entry if isinstance(entry, dict) else {"type": entry}
        try:
            runs = [measure(args.folder, entry, n) for _ in range(args.repeat)]
        except ConfigError as error:
            print(f"{text:<24} {str(error).splitlines()[0][:80]}")
            continue
        write_s, merge_s = min(runs, key=sum)
        print(f"{text:<24} {1e3 * write_s / n:8.2f} {1e3 * merge_s / n:8.2f}")


if __name__ == "__main__":
    main()
