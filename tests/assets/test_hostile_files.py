"""How many hostile files the tests read; ``tests/conftest.py`` limits time and memory of each."""

import importlib
import inspect
import math
from collections import Counter
from pathlib import Path

HOSTILE_MIN = 130
"""Over all kinds; and of each kind at least four."""


def count_marked() -> Counter[str]:
    """Numbers of cases of the tests that are marked with ``hostile``, by folder and file."""
    root = Path(__file__).parents[2]
    counts: Counter[str] = Counter()
    for path in sorted(root.glob("tests/*/test_*.py")):
        if "@pytest.mark.hostile" not in path.read_text("utf-8"):
            continue
        module = importlib.import_module(".".join(path.relative_to(root).with_suffix("").parts))
        for test in vars(module).values():
            marks = getattr(test, "pytestmark", ()) if inspect.isfunction(test) else ()
            if any(mark.name == "hostile" for mark in marks):
                cases = [len(list(m.args[1])) for m in marks if m.name == "parametrize"]
                counts[path.relative_to(root).as_posix()] += math.prod(cases)
    return counts


def test_there_are_enough_hostile_files_of_every_kind() -> None:
    """Meshes, robots, images, panoramas, archives, roads and stages."""
    counts = count_marked()
    print(dict(counts), counts.total())
    assert {name: n for name, n in counts.items() if n < 4} == {}
    assert len(counts) >= 5
    assert counts.total() >= HOSTILE_MIN
