"""Time, size and money of a run, extrapolated from a few measured samples."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from gen_data.runner.durable_files import format_bytes


@dataclass(frozen=True)
class Prices:
    """Prices in one currency; None = unknown.

    Attributes:
        cpu_hour: Price of one core for one hour.
        gpu_hour: Price of one GPU for one hour.
        gb_month: Price of storing 1e9 bytes for one month.
    """

    cpu_hour: float | None = None
    gpu_hour: float | None = None
    gb_month: float | None = None


@dataclass(frozen=True)
class Probe:
    """Means per sample, measured on this machine with one worker.

    Attributes:
        cpu_s: CPU seconds by stage.
        wall_s: Seconds between two samples of a worker; 0 if unknown.
        bytes: Size of its files; hard links count once.
        files: Number of files.
        has_gpu: Whether a GPU rendered.
        objects: Visible labelled objects by exported class, or by category without a label map.
    """

    cpu_s: Mapping[str, float]
    wall_s: float
    bytes: float
    files: float
    has_gpu: bool
    objects: Mapping[str, float] = field(default_factory=dict)


def estimate_rows(probe: Probe, n: int, cores: int, prices: Prices) -> Iterator[tuple[str, str]]:
    """Names and values of an estimate for ``n`` samples, for a table."""
    cpu_s = sum(probe.cpu_s.values())
    cpu_h, gpu_h = cpu_s * n / 3600.0, probe.wall_s * n / 3600.0
    size_gb = probe.bytes * n / 1e9
    size = format_bytes(probe.bytes * n)
    yield "size, measured", f"{size} ({probe.bytes / 1e3:.0f} kB per sample)"
    yield "files, measured", f"{probe.files * n:,.0f} ({probe.files:.1f} per sample)"
    yield "CPU, measured", f"{cpu_h:,.2f} h ({cpu_s:.3f} s per sample)"
    stages = ", ".join(f"{name} {seconds:.3f}" for name, seconds in probe.cpu_s.items())
    if stages:
        yield "CPU s per sample", stages
    yield f"time on {cores} cores", f"{cpu_h / cores:,.2f} h"
    most = sorted(probe.objects.items(), key=lambda item: -item[1])
    total = sum(probe.objects.values())
    shown = ", ".join(f"{name} {number:.2g}" for name, number in most if number)
    yield "labels, measured", f"{total:.2g} per sample{': ' if shown else ''}{shown}"
    if probe.has_gpu and probe.wall_s:
        yield "GPU, measured", f"{gpu_h:,.2f} h ({probe.wall_s:.3f} s per sample, one worker each)"
    if prices.cpu_hour is not None:
        yield "cost of CPU", f"{cpu_h * prices.cpu_hour:,.2f}"
    if prices.gpu_hour is not None and probe.has_gpu:
        yield "cost of GPU", f"{gpu_h * prices.gpu_hour:,.2f}"
    if prices.gb_month is not None:
        yield "cost of storage per month", f"{size_gb * prices.gb_month:,.2f}"
