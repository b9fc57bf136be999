"""Helpers of the benchmarks that measure whole runs."""

import platform
import resource
import tempfile
from functools import partial
from pathlib import Path

from gen_data.assemble.config import Config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.runner.identity import format_licences, make_plan
from gen_data.runner.run import Settings, Summary, run


def measure_run(config: Config, n: int, workers: int) -> Summary:
    """Generate a data set in a temporary folder."""
    factory = PipelineFactory(config, n)
    with tempfile.TemporaryDirectory() as folder:
        return run(
            make_plan(factory),
            factory,
            Path(folder) / "out",
            Settings(workers),
            partial(format_licences, factory),
        )


def cpu_s() -> float:
    """CPU time of this process and of its finished children."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in used)


def machine() -> str:
    """Architecture and processor, for the heading of a table."""
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return f"{platform.machine()}, {line.partition(':')[2].strip()}"
    return platform.machine()


def format_summary(summary: Summary) -> str:
    """Speed, memory, and CPU milliseconds per sample by stage."""
    lines = [
        f"{summary.samples_per_s:.1f} samples/s, {1e3 * sum(summary.cpu_s.values()):.0f} CPU"
        f" ms/sample, largest worker {summary.rss_bytes_max / 1e6:.0f} MB"
    ]
    lines += [f"    {stage:<10} {1e3 * s:7.1f} CPU ms" for stage, s in summary.cpu_s.items()]
    return "\n".join(lines)
