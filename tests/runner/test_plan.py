"""The plan: identity of a data set, and its division into shards."""

from dataclasses import replace
from pathlib import Path

import pytest

from gen_data.core.errors import StorageError
from gen_data.runner.plan import compare_plans, load_plan, plan_bytes, write_plan
from tests.runner.doubles import fake_plan


@pytest.mark.parametrize(
    ("n", "shard_size", "sizes"),
    [(10, 4, [4, 4, 2]), (1, 64, [1]), (64, 64, [64]), (65, 64, [64, 1])],
)
def test_shards_are_consecutive_ranges_and_the_last_is_shorter(
    n: int, shard_size: int, sizes: list[int]
) -> None:
    """A full last one adds none."""
    plan = fake_plan(n, shard_size)
    shards = [list(plan.samples_of(k)) for k in range(plan.shard_count)]
    assert [len(shard) for shard in shards] == sizes
    assert [i for shard in shards for i in shard] == list(range(n))


@pytest.mark.parametrize(("n", "shard_size"), [(0, 4), (10, 0)])
def test_a_plan_that_holds_nothing_is_refused(n: int, shard_size: int) -> None:
    with pytest.raises(ValueError, match="must be >= 1"):
        fake_plan(n, shard_size)


def test_a_plan_comes_back_from_its_file_whatever_the_order_of_keys(tmp_path: Path) -> None:
    """Written and loaded, a plan equals itself and its file is one line of sorted keys."""
    plan = fake_plan()
    write_plan(plan, tmp_path, tmp_path)
    assert load_plan(tmp_path) == plan
    text = (tmp_path / "plan.json").read_text()
    assert text.count("\n") == 1
    assert text.startswith('{"assets":')
    first = replace(fake_plan(), config={"a": 1, "b": [2.5, None]})
    second = replace(fake_plan(), config={"b": [2.5, None], "a": 1})
    assert plan_bytes(first) == plan_bytes(second)
    assert compare_plans(first, second) == []


def test_differences_name_the_field_as_in_yaml_once_and_both_values() -> None:
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
    # It is a field of the configuration and of the plan.
    old = replace(fake_plan(), seed=3, config={"seed": 3})
    new = replace(fake_plan(), seed=9, config={"seed": 9})
    assert compare_plans(old, new) == ["seed: was 3, now 9"]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"n": 1}', "not json", '{"config": 1, "q": 2}'])
def test_what_is_no_plan_is_refused_by_name(tmp_path: Path, text: str) -> None:
    (tmp_path / "plan.json").write_text(text)
    with pytest.raises(StorageError, match=r"plan\.json: damaged"):
        load_plan(tmp_path)
