"""Speed of exports and loaders: ``python -m benchmarks.bench_training [--n 200] [--workers 2]``.

Prints samples per second, and CPU milliseconds per sample of all processes, of generation, of
exports in label-only formats, of loading the finished data set with decoded images, in every
encoding of photographs, and of rendering while training. Each figure includes the start of the
worker processes. CPU time depends less on other work on the machine.
"""

import argparse
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import gen_data
from gen_data.targets import detection_target

ENCODINGS = ("png", "jpeg", "webp", "webp_lossless")


def measure(label: str, n: int, work: Callable[[], object]) -> None:
    """Print samples per second and CPU milliseconds per sample."""
    started_s, started_cpu_s = time.perf_counter(), cpu_s()
    work()
    rate, cpu_ms = n / (time.perf_counter() - started_s), 1e3 * (cpu_s() - started_cpu_s) / n
    print(f"{label:<30} {rate:7.1f} samples/s {cpu_ms:7.1f} CPU ms", flush=True)


def cpu_s() -> float:
    """CPU time of this process and of those that it has waited for."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in used)


def load(samples: gen_data.Dataset, workers: int) -> int:
    """Read an epoch; return the number of batches."""
    loader = gen_data.Loader(samples, detection_target, batch_size=8, shuffle=True, workers=workers)
    return sum(1 for _ in loader)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", default="tabletop.yaml")
    parser.add_argument("--camera", default="color")
    parser.add_argument("--encodings", nargs="*", default=["png"], choices=ENCODINGS)
    parser.add_argument("--n", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args()
    n, workers = args.n, args.workers
    plain = ["splits={train: 1, val: 0, test: 0}", "shard_size=50"]
    with tempfile.TemporaryDirectory() as folder:
        for kind in args.encodings:
            out = Path(folder) / kind
            overrides = [
                *plain,
                f"sensors.{args.camera}.rgb_encoding={{format: {kind}}}",
                "exporters=[{type: coco}]",
            ]

            def generate(out: Path = out, overrides: list[str] = overrides) -> None:
                gen_data.generate(args.config, n, out=out, workers=workers, overrides=overrides)

            measure(f"generate, {kind}", n, generate)
            measure(f"load, {kind}", n, lambda: load(gen_data.open(out), workers))  # noqa: B023
        stored = Path(folder) / args.encodings[0]
        for formats in (["coco"], ["kitti"], ["yolo"], ["coco", "kitti", "yolo"]):
            out = Path(folder) / "_".join(formats)
            label = f"export {', '.join(formats)}"
            measure(label, n, lambda: gen_data.export(stored, formats, out, workers=workers))  # noqa: B023
        data = gen_data.Dataset(args.config, n=n, overrides=plain)
        measure("load, rendered", n, lambda: load(data, workers))


if __name__ == "__main__":
    main()
