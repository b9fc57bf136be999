"""Latency, rest and memory of the live page: ``python -m benchmarks.bench_edit [CONFIG...]``.

Starts ``gen-data edit`` on a file that extends each configuration, as a user does, opens the page
in headless Chromium, and changes its text: the exposure of the first camera (its scenes are known)
and the seed (they are new). A time is that from the change in the editor to the first picture
painted, by the clock of the browser. Memory is resident memory from procfs.
"""

import argparse
import importlib
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.runs import machine
from gen_data.assemble.config import load_config

CONFIGS = ("tabletop.yaml", "street.yaml")
CHROMIUM = ("/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome")
FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking")
WAIT_MS = 600_000
"""A new machine makes the assets of a scene first."""
CHANGE = """async ([text, count, limit_ms]) => {
  const element = document.querySelector('.nicegui-codemirror');
  const editor = await getElement(+element.id.slice(1)).editorPromise;
  const begin = performance.now(), shown = new Map();
  return new Promise((done, fail) => {
    setTimeout(() => fail(new Error('no new pictures')), limit_ms);
    const loaded = (event) => {
      const tile = event.target.closest?.('.gd-tile');
      if (!tile || shown.has(tile)) return;
      shown.set(tile, 0);
      requestAnimationFrame(() => {
        shown.set(tile, performance.now() - begin);
        if (shown.size < count || [...shown.values()].includes(0)) return;
        document.removeEventListener('load', loaded, true);
        done([...shown.values()]);
      });
    };
    document.addEventListener('load', loaded, true);
    editor.dispatch({ changes: { from: 0, to: editor.state.doc.length, insert: text } });
  });
}"""
"""Replaces the text of the editor; milliseconds until each picture is painted."""
DRAWN = """(count) => {
  const tiles = [...document.querySelectorAll('.gd-tile')];
  return tiles.length === count && !document.querySelector('.gd-old')
    && tiles.every((tile) => tile.querySelector('img')?.naturalWidth);
}"""


@dataclass(frozen=True)
class Process:
    """A process of the server.

    Attributes:
        cpu_s: Processor time since its start.
        rss_bytes: Resident memory.
    """

    pid: int
    cpu_s: float
    rss_bytes: int


def text_of(config: str, camera: str, seed: int, exposure_ev: float) -> str:
    """The text of a file that extends a configuration, by its path or shipped name."""
    config = str(Path(config).resolve()) if Path(config).exists() else config
    pipeline = f"{{exposure_compensation_ev: {exposure_ev}}}"
    return (
        f"extends: {config}\nseed: {seed}\n"
        f"sensors:\n  - {{name: {camera}, image_pipeline: {pipeline}}}\n"
    )


def read_process(pid: int) -> Process:
    """Processor time and memory of a process, from procfs."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    ticks = int(fields[11]) + int(fields[12])
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return Process(pid, ticks / os.sysconf("SC_CLK_TCK"), pages * os.sysconf("SC_PAGE_SIZE"))


def descendants(pid: int) -> list[int]:
    """Ids of a process and all that it has started, the process itself first."""
    children: dict[int, list[int]] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue  # It has ended meanwhile.
            children.setdefault(int(fields[1]), []).append(int(entry.name))
    found = [pid]
    for one in found:
        found += sorted(children.get(one, ()))
    return found


def read_all(server: int) -> list[Process]:
    """The server first, then the processes that render; none that have ended."""
    found = [read_process(pid) for pid in descendants(server)]
    return [one for one in found if one.rss_bytes]


def cpu_s(server: int) -> float:
    """Processor time of the server and its processes."""
    return sum(one.cpu_s for one in read_all(server))


def describe_times(name: str, times_ms: Sequence[float]) -> str:
    """Median, smallest and largest of some times, in seconds."""
    low, middle, high = min(times_ms), statistics.median(times_ms), max(times_ms)
    return f"{name:<34} {1e-3 * middle:6.2f} {1e-3 * low:6.2f} {1e-3 * high:6.2f} s"


def describe_memory(name: str, processes: Sequence[Process]) -> str:
    """Memory of the server and of each process that renders."""
    server, *workers = [f"{one.rss_bytes / 1e6:.0f}" for one in processes]
    return f"{name:<34} server {server} MB, processes {', '.join(workers)} MB"


@contextmanager
def served(file: Path, workers: int) -> Iterator[tuple[int, str]]:
    """Process id and address of a server of a file."""
    command = [sys.executable, "-m", "gen_data", "edit", file.name, "--no-browser", "-w"]
    # NiceGUI serves its own test port where it sees pytest.
    variables = {k: v for k, v in os.environ.items() if not k.startswith(("PYTEST", "NICEGUI"))}
    with subprocess.Popen(
        [*command, str(workers)], cwd=file.parent, stdout=subprocess.PIPE, text=True, env=variables
    ) as server:
        assert server.stdout is not None
        found = re.search(r"http://\S+", server.stdout.readline())
        if found is None:
            raise SystemExit("the server has not started; its message is above")
        try:
            yield server.pid, found[0]
        finally:
            server.send_signal(signal.SIGINT)
            server.wait(60)


@contextmanager
def browser_page(url: str) -> Iterator[Any]:
    """The page in headless Chromium, 1280 x 900."""
    try:
        playwright = importlib.import_module("playwright.sync_api")
    except ImportError:
        raise SystemExit("needs the package playwright") from None
    program = next((path for path in CHROMIUM if Path(path).exists()), None)
    if program is None:
        raise SystemExit(f"needs Chromium: one of {', '.join(CHROMIUM)}")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=program, args=list(FLAGS))
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.set_default_timeout(WAIT_MS)
        page.goto(url)
        yield page
        browser.close()


def change(page: Any, text: str, pictures: int) -> list[float]:
    """Replace the text of the editor; sorted times until the pictures are painted [ms]."""
    return sorted(page.evaluate(CHANGE, [text, pictures, WAIT_MS]))


def show(page: Any, pictures: int) -> None:
    """Choose the number of pictures, and wait until all of them are drawn."""
    page.wait_for_selector(".gd-tile")
    page.click("[data-grid=slots]")
    page.click(f".q-item:has-text('{pictures}') >> nth=0")
    page.wait_for_function(DRAWN, arg=pictures)


def measure(config: str, changes: int, pictures: int, workers: int, rest_s: float) -> None:
    """Print all figures of a configuration."""
    general = load_config(config, first_scene_only=True)
    camera = next(s.name for s in general.probes[0].sensors if hasattr(s, "image_pipeline"))
    seed = general.general.seed
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "mine.yaml"
        file.write_text(text_of(config, camera, seed, 0.0))
        with served(file, workers) as (server, url), browser_page(url) as page:
            started_s = time.monotonic()
            show(page, pictures)
            print(f"{config}, {pictures} pictures, {workers} processes that render")
            print(f"{'all pictures of the opened page':<34} {time.monotonic() - started_s:6.2f} s")
            print(describe_memory("memory then", read_all(server)))
            print(f"{'':<34} median   min    max")
            known = [text_of(config, camera, seed, 0.05 * k) for k in range(1, changes + 1)]
            new = [text_of(config, camera, seed + k, 0.0) for k in range(1, changes + 1)]
            for kind, texts in (("known scenes", known), ("new seed", new), ("seen seed", new)):
                begun_s = cpu_s(server)
                times = [change(page, text, pictures) for text in texts]
                print(describe_times(f"{kind}: first picture", [one[0] for one in times]))
                print(describe_times(f"{kind}: all pictures", [one[-1] for one in times]))
                page.wait_for_timeout(1000)
                spent_s = (cpu_s(server) - begun_s) / changes
                print(f"{kind + ': processor, a change':<34} {spent_s:6.2f} s", flush=True)
                change(page, text_of(config, camera, seed, 0.0), pictures)
            last = read_all(server)
            print(describe_memory(f"memory after {3 * changes} texts", last))
            page.wait_for_timeout(1000 * rest_s)
            share = 100.0 * (cpu_s(server) - sum(one.cpu_s for one in last)) / max(rest_s, 1e-9)
            print(f"{'at rest':<34} {share:.1f} % of a core over {rest_s:g} s", flush=True)


def main() -> None:
    """Print the figures of docs/edit.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "configs",
        nargs="*",
        metavar="CONFIG",
        help="paths or shipped names [default: tabletop and street]",
    )
    parser.add_argument("--changes", type=int, default=12, help="of each kind")
    parser.add_argument("--pictures", type=int, default=4, choices=(4, 6, 8, 12, 16, 24))
    parser.add_argument("--workers", type=int, default=min(os.cpu_count() or 1, 4))
    parser.add_argument("--rest", type=float, default=15.0, help="seconds at rest")
    arguments = parser.parse_args()
    load = " ".join(f"{one:.1f}" for one in os.getloadavg())
    print(f"{machine()}, {os.cpu_count()} cores, load before {load}")
    for config in arguments.configs or CONFIGS:
        measure(config, arguments.changes, arguments.pictures, arguments.workers, arguments.rest)


if __name__ == "__main__":
    main()
