"""The comparison of exports with readers of other makers finds what is planted in a view."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from benchmarks.readers.__main__ import DATA, HERE
from benchmarks.readers.evaluations.definitions import definitions
from benchmarks.readers.table import READERS, WITHOUT_READER
from benchmarks.readers.views import Comparison, Thing, View, from_corner
from gen_data.exporters import TABLE

ROOT = Path(__file__).parents[2]
MASK = np.zeros((8, 10), bool)
MASK[2:6, 1:5] = True
CUP, BOWL = from_corner("cup", (1, 2, 4, 4), MASK), from_corner("bowl", (6, 0, 2, 3), ~MASK)
STATED = View("000000003_color", (CUP, BOWL), (100.0, 100.0, 5.0, 4.0, -0.3))


def compare(found: View, is_partial: bool = False) -> Comparison:
    comparison = Comparison()
    comparison.add_views([STATED], [found], is_partial)
    return comparison


def test_equal_views_have_no_difference() -> None:
    """In any order of things; coefficients that are left out at the end are 0."""
    found = replace(STATED, things=(BOWL, CUP), lens=(*STATED.lens, 0.0, 0.0))

    assert compare(found) == Comparison(objects=2, worst=0.0, iou=1.0, lens=0.0)


@pytest.mark.parametrize(("found", "name", "value"), [
    (replace(STATED, things=(replace(CUP, numbers=CUP.numbers + 0.25), BOWL)), "worst", 0.25),
    (replace(STATED, things=(replace(CUP, mask=MASK & (MASK.cumsum(1) < 4)), BOWL)), "iou", 0.75),
    (replace(STATED, lens=(100.0, 100.0, 5.5, 4.0, -0.3)), "lens", 0.5),
    (replace(STATED, lens=(100.0, 100.0, 5.0, 4.0)), "lens", 0.3),
    (replace(STATED, things=(CUP,)), "faults", ["000000003_color: bowl [6. 0. 8. 3.] is missing"]),
    (replace(STATED, things=(CUP, replace(BOWL, category="cup"))), "faults",
     ["000000003_color: cup [6. 0. 8. 3.] is not in the data set",
      "000000003_color: bowl [6. 0. 8. 3.] is missing"]),
    (replace(STATED, name="000000004_color"), "faults",
     ["000000003_color is missing", "000000004_color is not in the data set"]),
])  # fmt: skip
def test_differences_are_measured_and_named(found: View, name: str, value: object) -> None:
    """Half of a mask's row is a quarter of it; absent lens terms count."""
    assert getattr(compare(found), name) == value


def test_a_format_that_leaves_things_out_may_not_add_any() -> None:
    """Neither of another class nor beside those that are there."""
    assert compare(replace(STATED, things=(CUP,)), is_partial=True).faults == []
    twice = compare(replace(STATED, things=(CUP, CUP)), is_partial=True)
    assert twice.faults == ["000000003_color: cup [1. 2. 5. 6.] is not in the data set"]


def test_numbers_of_another_kind_do_not_match() -> None:
    """A box in space is no box in the image."""
    cube = Thing("cup", np.zeros(12))
    assert len(compare(replace(STATED, things=(cube, BOWL))).faults) == 2


def test_every_exporter_has_a_reader_or_a_reason() -> None:
    """Of another maker, and its configuration writes the format."""
    written = {
        name: yaml.safe_load((HERE / file).read_text())["exporters"]
        for name, (file, _) in DATA.items()
    }

    read = {reader.format for reader in READERS}
    assert read | WITHOUT_READER.keys() == {*TABLE}
    assert not read & WITHOUT_READER.keys()
    for reader in READERS:
        listed = written[reader.data.replace("runs", "tabletop")]
        assert reader.format in {exporter["type"] for exporter in listed}


@pytest.mark.slow
def test_readers_find_what_data_sets_state() -> None:
    command = [sys.executable, "-m", "benchmarks.readers"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count(" yes ") > 10


def test_functions_of_an_evaluation_run_without_the_packages_that_its_file_imports(
    tmp_path: Path,
) -> None:
    file = tmp_path / "metric.py"
    file.write_text(
        "import a_framework\n"
        "a_framework.start()\n"
        "@a_framework.register\n"
        "class Score:\n"
        "    def of(self, x: a_framework.Tensor) -> float:\n"
        "        return share(x)\n"
        "def share(x):\n"
        "    return np.mean(x > limit)\n"
    )
    score, share = definitions(file, "Score share", np=np, limit=2)

    assert score().of(np.arange(4)) == share(np.arange(4)) == 0.25
