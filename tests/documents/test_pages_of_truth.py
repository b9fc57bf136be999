"""The YAML and the Python of the pages on each kind of truth run, in the order of the page."""

import re
from pathlib import Path

import pytest

import gen_data

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SAMPLES = {"points": 3, "flow": 3}
"""Samples of the configurations that need more than one."""
SMALL = {
    "points": ["steps_per_scene=3", "shard_size=3"],
    "flow": ["steps_per_scene=3", "shard_size=3"],
}
PAGES = ("detectability", "faults", "fiducials", "layers", "occupancy", "text", "tracks")
"""Pages of maps need devkits, and ladders a command: see docs/maps.md, docs/study.md."""


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_a_page_of_truth_has_a_picture_yaml_and_code_that_reads_it(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Configurations of at most ten lines, each generated into ``out/<name>``."""
    page = (DOCS / f"{name}.md").read_text("utf-8")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    kinds = []
    for kind, block in BLOCK.findall(page):
        if kind == "yaml":
            file = re.match(r"# (\w+)\.yaml\n", block)
            assert file, block
            assert len(block.splitlines()) <= 10
            path, stem = tmp_path / f"{file[1]}.yaml", file[1]
            path.write_text(block, "utf-8")
            gen_data.generate(
                path, SAMPLES.get(stem, 1), out=f"out/{stem}", workers=0,
                overrides=SMALL.get(stem, []),
            )  # fmt: skip
        elif kind == "python":
            exec(compile(block, f"{name}.md", "exec"), names)
        kinds.append(kind)
    assert {"yaml", "python"} <= set(kinds)
    assert "![" in page
