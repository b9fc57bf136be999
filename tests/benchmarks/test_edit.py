"""Figures of the live page: what they are made of, and that the command prints them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.bench_edit import (
    Process,
    descendants,
    describe_memory,
    describe_times,
    read_process,
    text_of,
)
from gen_data.assemble.config import parse_config
from tests.browser import open_browser
from tests.repository import ROOT

SMALL = """\
extends: tabletop.yaml
without: {randomizers: all, sensors: [pseudo_lidar]}
elements: {arm: {present: false}, hands: {present: false}, clutter: {count: 0}}
sensors: [{name: color, size_px: [64, 48]}]
views_per_scene: 1
exporters: []
"""


def test_times_have_their_median_and_ends() -> None:
    """In seconds, of milliseconds in any order."""
    assert describe_times("a", [900.0, 100.0, 200.0]).split() == ["a", "0.20", "0.10", "0.90", "s"]


def test_memory_is_that_of_the_server_and_of_each_process() -> None:
    """The server is first."""
    found = [Process(1, 0.0, 160_000_000), Process(2, 0.0, 400_000_000), Process(3, 0.0, 9_000_000)]
    assert describe_memory("m", found).split(maxsplit=1)[1] == "server 160 MB, processes 400, 9 MB"


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs procfs")
def test_processes_are_found_with_those_that_they_started() -> None:
    """Also behind another process; memory and time are those of the system's own count."""
    command = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'print(1); input()'])"
    with subprocess.Popen(
        [sys.executable, "-c", command], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as child:
        assert child.stdout is not None
        child.stdout.readline()
        found = descendants(child.pid)
        assert (len(found), found[0]) == (2, child.pid)
        child.communicate(b"\n")
    assert read_process(os.getpid()).rss_bytes > 10_000_000


def test_texts_differ_in_seed_and_exposure_only() -> None:
    """Both are valid, and have the scenes of the configuration that they extend."""
    texts = [text_of("tabletop.yaml", "color", *given) for given in ((3, 0.0), (4, 0.5))]
    one, other = (parse_config(text, "a.yaml", "a") for text in texts)
    assert (one.general.seed, other.general.seed) == (3, 4)
    cameras = [config.probes[0].sensors[0].image_pipeline for config in (one, other)]  # type: ignore[attr-defined]
    assert [camera.exposure_compensation_ev.value for camera in cameras] == [0.0, 0.5]


@pytest.mark.slow
def test_the_command_prints_all_figures_of_a_small_configuration(tmp_path: Path) -> None:
    """With the browser, as its user starts it: four pictures of an empty table, 64 x 48 pixels."""
    pytest.importorskip("nicegui")
    with open_browser():
        pass  # Skips without one.
    small = tmp_path / "small.yaml"
    small.write_text(SMALL)
    command = [sys.executable, "-m", "benchmarks.bench_edit", str(small)]
    options = ["--changes", "1", "--workers", "1", "--rest", "0.5"]
    out = subprocess.run([*command, *options], cwd=ROOT, capture_output=True, text=True, check=True)
    lines = out.stdout.splitlines()
    assert lines[1] == f"{small}, 4 pictures, 1 processes that render"
    assert [line.partition(":")[0] for line in lines if "first picture" in line] == [
        "known scenes", "new seed", "seen seed"
    ]  # fmt: skip
    assert lines[-1].endswith("% of a core over 0.5 s")
