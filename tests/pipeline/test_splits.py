"""Scenes are assigned to splits at random, or in turns."""

import warnings
from collections import Counter
from pathlib import Path

import pytest

from gen_data.api.generate import make_factory
from gen_data.assemble.config import load_config
from gen_data.core.errors import ConfigWarning
from gen_data.pipeline.splits import Assignment, split_of, warn_of_empty_splits

SHARES = {"train": 0.8, "val": 0.1, "test": 0.1}


def turns(count: int, shares: dict[str, float]) -> list[str]:
    return [split_of(k, shares, "round_robin", 7) for k in range(count)]


@pytest.mark.parametrize(
    "shares", [SHARES, {"train": 0.7, "val": 0.2, "test": 0.1}, {"train": 1 / 3, "val": 2 / 3}]
)
def test_splits_in_turns_never_stray_from_their_shares_by_a_whole_scene(
    shares: dict[str, float],
) -> None:
    """The quota property of apportionment, for every number of scenes up to 300."""
    taken = turns(300, shares)
    for n in range(1, 301):
        counts = Counter(taken[:n])
        assert all(abs(counts[name] - share * n) < 1.0 for name, share in shares.items())


def test_every_split_has_a_scene_as_soon_as_there_are_about_ten() -> None:
    """One of ten is the share of the smallest."""
    assert set(turns(10, SHARES)) == set(SHARES)


def test_turns_of_later_scenes_continue_those_of_earlier_ones() -> None:
    """More scenes change no scene's split, however many there are."""
    taken = turns(5000, SHARES)

    assert taken[:3] == turns(3, SHARES)
    assert taken[4000:4010] == taken[:10]  # 4000 scenes fill whole rounds of ten


def test_random_assignment_is_that_of_earlier_releases() -> None:
    """Golden: data sets keep their splits."""
    drawn = "".join(split_of(k, SHARES, "random", 7)[1] for k in range(24))

    assert drawn == "rrrrrrrrrerrrrerrrarrrrr"


@pytest.mark.parametrize(("count", "assignment", "message"), [
    (1, "round_robin", "splits: 1 scene leaves val and test empty; expected more scenes, or"),
    (2, "random", "expected more scenes, splits.assign: round_robin, or other shares"),
])  # fmt: skip
def test_an_empty_split_is_warned_of_with_a_remedy(
    count: int, assignment: Assignment, message: str
) -> None:
    """Before anything runs."""
    with pytest.warns(ConfigWarning, match=message):
        warn_of_empty_splits(count, SHARES, assignment, 7, stated=True)


def test_splits_that_nobody_asked_for_may_be_empty_below_a_whole_scene() -> None:
    """A tenth of nine scenes is none; seed 7 draws neither of the two for the first nine."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_empty_splits(9, SHARES, "random", 7, stated=False)
    with pytest.warns(ConfigWarning, match="9 scenes leave val and test empty"):
        warn_of_empty_splits(9, SHARES, "random", 7, stated=True)
    with pytest.warns(ConfigWarning, match="10 scenes leave val empty"):
        warn_of_empty_splits(10, SHARES, "random", 7, stated=False)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("overrides", "warned"), [((), 0), (("splits={train: 0.6, val: 0.2, test: 0.2}",), 1)]
)
def test_a_short_run_of_a_shipped_configuration_warns_of_nothing(
    overrides: tuple[str, ...], warned: int
) -> None:
    """The first command of the README; whoever sets shares is warned."""
    config = load_config("tabletop", overrides=overrides)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        make_factory(config, 20)

    assert len(caught) == warned


def test_no_warning_where_every_split_has_a_scene() -> None:
    """Or where a split has no share."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_empty_splits(10, SHARES, "round_robin", 7, stated=True)
        warn_of_empty_splits(1, {"train": 1.0}, "random", 7, stated=True)


def test_a_configuration_says_how_scenes_are_assigned() -> None:
    """At random, by default."""
    assert load_config("tabletop").general.splits.assign == "random"
    spec = load_config("tabletop", overrides=("splits.assign=round_robin",))
    assert spec.general.splits.assign == "round_robin"


@pytest.mark.parametrize(("given", "shares"), [
    ("{train: 1.0}", {"train": 1.0}),
    ("{val: 1}", {"val": 1.0}),
    ("{train: 0.9, test: 0.1}", {"train": 0.9, "test": 0.1}),
    ("{assign: round_robin}", {"train": 0.8, "val": 0.1, "test": 0.1}),
])  # fmt: skip
def test_shares_that_are_not_given_are_zero_beside_those_that_are(
    given: str, shares: dict[str, float], tmp_path: Path
) -> None:
    """Also where a configuration with all three shares is extended; the method is inherited."""
    inherited = "splits: {train: 0.8, val: 0.1, test: 0.1, assign: round_robin}\n"
    (tmp_path / "base.yaml").write_text(f"extends: tabletop.yaml\n{inherited}")
    for base, method in (("tabletop.yaml", "random"), ("base.yaml", "round_robin")):
        (tmp_path / "mine.yaml").write_text(f"extends: {base}\nsplits: {given}\n")
        config = load_config(str(tmp_path / "mine.yaml"))
        assert config.split_shares == shares
        assert config.general.splits.assign == ("round_robin" if "assign" in given else method)
