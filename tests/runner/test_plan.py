"""The plan: what identifies a data set, and how it is cut into shards."""

from dataclasses import replace
from pathlib import Path

import pytest

from gen_data.core.errors import StorageError
from gen_data.runner.plan import compare_plans, load_plan, plan_bytes, write_plan
from tests.runner.doubles import fake_plan


def test_shards_are_consecutive_ranges_and_the_last_is_shorter() -> None:
    """Ten samples in shards of four are 0-3, 4-7 and 8-9."""
    plan = fake_plan(n=10, shard_size=4)

    assert plan.shard_count == 3
    assert [list(plan.samples_of(k)) for k in range(3)] == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9]]


@pytest.mark.parametrize(("n", "shard_size", "shards"), [(1, 64, 1), (64, 64, 1), (65, 64, 2)])
def test_shard_count_rounds_up(n: int, shard_size: int, shards: int) -> None:
    """A partial shard is a shard; a full last one adds none."""
    assert fake_plan(n, shard_size).shard_count == shards


def test_a_plan_that_holds_nothing_is_refused() -> None:
    """Both n and shard_size are at least 1."""
    with pytest.raises(ValueError, match="must be >= 1"):
        fake_plan(n=0)


def test_a_plan_comes_back_from_its_file(tmp_path: Path) -> None:
    """Written and loaded, a plan equals itself and its file is one line of sorted keys."""
    plan = fake_plan()

    write_plan(plan, tmp_path, tmp_path)

    assert load_plan(tmp_path) == plan
    text = (tmp_path / "plan.json").read_text()
    assert text.count("\n") == 1
    assert text.startswith('{"assets":')


def test_equal_plans_are_equal_bytes_whatever_the_order_of_keys() -> None:
    first = replace(fake_plan(), config={"a": 1, "b": [2.5, None]})
    second = replace(fake_plan(), config={"b": [2.5, None], "a": 1})

    assert plan_bytes(first) == plan_bytes(second)
    assert compare_plans(first, second) == []


def test_differences_name_the_field_as_in_yaml_and_both_values() -> None:
    """Fields of the configuration carry no prefix; list items have their number."""
    old = fake_plan(n=10)
    new = replace(
        fake_plan(n=20),
        config={"camera": {"fov_deg": 60}, "objects": [{"count": 4}], "added": True},
        assets={},
    )

    assert compare_plans(old, new) == [
        "added: was (absent), now true",
        "camera.fov_deg: was 50, now 60",
        "objects[0].count: was 3, now 4",
        f'assets.asset: was "{"00" * 32}", now (absent)',
        "n: was 10, now 20",
    ]


def test_a_seed_that_differs_is_named_once() -> None:
    """It is a field of the configuration and of the plan."""
    old = replace(fake_plan(), seed=3, config={"seed": 3})
    new = replace(fake_plan(), seed=9, config={"seed": 9})

    assert compare_plans(old, new) == ["seed: was 3, now 9"]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"n": 1}', "not json", '{"config": 1, "q": 2}'])
def test_what_is_no_plan_is_refused_by_name(tmp_path: Path, text: str) -> None:
    (tmp_path / "plan.json").write_text(text)

    with pytest.raises(StorageError, match=r"plan\.json: damaged"):
        load_plan(tmp_path)
