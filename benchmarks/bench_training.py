"""Speed of exports and loaders: ``python -m benchmarks.bench_training [--n 200] [--workers 2]``.

Prints samples per second of an export in label-only formats, of reading a finished data set with
decoded images, and of rendering while training beside the generation of the same samples. Each
figure includes the start of the worker processes.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import gen_data
from gen_data.targets import detection_target


def rate(n: int, work: Callable[[], object]) -> float:
    """Samples per second."""
    started_s = time.perf_counter()
    work()
    return n / (time.perf_counter() - started_s)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", default="tabletop.yaml")
    parser.add_argument("--n", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args()
    n, workers = args.n, args.workers
    overrides = ["splits={train: 1, val: 0, test: 0}", "shard_size=50"]
    with tempfile.TemporaryDirectory() as folder:
        stored, data = Path(folder) / "set", gen_data.Dataset(args.config, n=n, overrides=overrides)
        made = rate(
            n,
            lambda: gen_data.generate(
                args.config, n, out=stored, workers=workers, overrides=overrides
            ),
        )
        print(f"generate                      {made:7.1f} samples/s")
        for formats in (["coco"], ["kitti"], ["yolo"], ["coco", "kitti", "yolo"]):
            out = Path(folder) / "_".join(formats)
            speed = rate(n, lambda: gen_data.export(stored, formats, out, workers=workers))  # noqa: B023
            print(f"export {', '.join(formats):<22} {speed:7.1f} samples/s")
        for name, samples in (("finished set", gen_data.open(stored)), ("rendered", data)):
            loader = gen_data.Loader(
                samples, detection_target, batch_size=8, shuffle=True, workers=workers
            )
            speed = rate(n, lambda: sum(1 for _ in loader))  # noqa: B023
            print(f"load {name:<24} {speed:7.1f} samples/s")


if __name__ == "__main__":
    main()
