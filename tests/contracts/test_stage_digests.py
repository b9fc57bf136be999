"""Which stage the comparison with stored digests names."""

from pathlib import Path

import pytest

from tests.contracts import stage_digests
from tests.contracts.stage_digests import STAGES, find_change, read_stored

NAME = "tabletop"


@pytest.fixture(autouse=True)
def _made(monkeypatch: pytest.MonkeyPatch) -> None:
    stored = read_stored()
    monkeypatch.setattr(stage_digests, "digests_of", lambda _: dict(stored["samples"][NAME]))
    monkeypatch.setattr(stage_digests, "numerics_of", lambda _: dict(stored["numerics"]))


@pytest.mark.parametrize("stage", STAGES)
def test_the_first_changed_stage_is_named(stage: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """All stages after it change, too."""
    changed = dict.fromkeys(STAGES[STAGES.index(stage) :], "0" * 64)
    found = {**read_stored()["samples"][NAME], **changed}
    assert find_change(NAME, Path()) == ""

    monkeypatch.setattr(stage_digests, "digests_of", lambda _: found)

    assert find_change(NAME, Path()) == stage


def test_a_machine_that_renders_differently_compares_scenes_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its images may differ although the program is the same."""
    numerics = {**read_stored()["numerics"], "render": "0" * 64}
    monkeypatch.setattr(stage_digests, "numerics_of", lambda _: numerics)
    found = dict.fromkeys(STAGES[1:], "0" * 64)
    known = read_stored()["samples"][NAME]

    monkeypatch.setattr(stage_digests, "digests_of", lambda _: {**known, **found})
    assert find_change(NAME, Path()) == ""
    monkeypatch.setattr(stage_digests, "digests_of", lambda _: {**found, "scene": "0" * 64})
    assert find_change(NAME, Path()) == "scene"
