"""Loading for training: the order of samples, and its independence."""

import os
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import gen_data
from gen_data.core.errors import ConfigError

VIEWS = 3


class Numbers(Sequence[int]):
    def __init__(self, n: int | None) -> None:
        self.n = n
        self.read: list[int] = []

    @property
    def is_bounded(self) -> bool:
        return self.n is not None

    def scene_indices(self, positions: NDArray[np.int64]) -> NDArray[np.int64]:
        return positions // VIEWS

    def __len__(self) -> int:
        assert self.n is not None
        return self.n

    def __getitem__(self, index: Any) -> Any:
        self.read.append(index)
        return index


def itself(sample: Any) -> Any:
    return sample


def loader(n: int | None = 31, **options: Any) -> gen_data.Loader[int]:
    return gen_data.Loader(Numbers(n), itself, **options)  # type: ignore[arg-type]


def flat(batches: Iterator[list[int]] | gen_data.Loader[int]) -> list[int]:
    return [item for batch in batches for item in batch]


def test_every_epoch_has_every_sample_once_in_an_order_that_the_seed_repeats() -> None:
    """In batches of the size, the last one smaller; as many as ``len`` states."""
    for shuffle in (False, True):
        batches = list(loader(batch_size=4, shuffle=shuffle))
        assert sorted(flat(iter(batches))) == list(range(31))
        assert [len(batch) for batch in batches] == [4] * 7 + [3]
        assert len(batches) == len(loader(batch_size=4))
    source = loader()
    assert flat(source) == flat(source) == list(range(31))
    # The same seed gives the same epochs, another seed others.
    one, same, other = (loader(shuffle=True, seed=seed) for seed in (1, 1, 2))
    first, second = flat(one), flat(one)
    assert first != second
    assert [flat(same), flat(same)] == [first, second]
    assert flat(other) != first
    assert first != sorted(first)
    # Epoch e has the samples from e times its size.
    source = loader(None, epoch_size=6, shuffle=True)
    assert [sorted(flat(source)) for _ in range(3)] == [
        list(range(6)), list(range(6, 12)), list(range(12, 18)),
    ]  # fmt: skip
    # Chi-squared: with all scenes mixed, every sample is equally likely to come first.
    from scipy.stats import chisquare

    first = [flat(loader(12, shuffle=True, seed=seed))[0] for seed in range(1200)]
    assert chisquare(np.bincount(first, minlength=12)).pvalue > 1e-4


@pytest.mark.parametrize("stop", [1, 4, 7])
@pytest.mark.parametrize("shuffle", [False, True])
def test_a_loader_goes_on_where_another_one_stopped(stop: int, shuffle: bool) -> None:
    """In the middle of an epoch, with the batches of an uninterrupted run and no sample twice.

    Nothing is rendered for samples that were handed out.
    """
    options = {"batch_size": 4, "shuffle": shuffle, "mixed_scenes": 3}
    whole = loader(**options)
    expected = [*whole, *whole]
    stopped = loader(**options)
    batches = iter(stopped)
    done = [next(batches) for _ in range(stop)]
    numbers = Numbers(31)
    resumed = gen_data.Loader(numbers, itself, **options)  # type: ignore[arg-type, var-annotated]
    resumed.load_state_dict(stopped.state_dict())
    rest = list(resumed)
    assert (
        sorted(numbers.read)
        == sorted(flat(iter(rest)))
        == sorted({*range(31)} - {*flat(iter(done))})
    )
    assert [*done, *rest, *resumed] == expected


def test_ranks_share_an_epoch_and_views_of_a_scene_stay_together() -> None:
    """And a scene is on one rank only, because its views share their physics."""
    parts = [flat(loader(shuffle=True, rank=rank, world_size=3)) for rank in range(3)]
    assert sorted(flat(iter(parts))) == list(range(31))
    scenes = [{number // VIEWS for number in part} for part in parts]
    assert sum(map(len, scenes)) == len(set.union(*scenes))
    # Whatever the order in which they are handed out.
    numbers = Numbers(30)
    handed = flat(gen_data.Loader(numbers, itself, shuffle=True))  # type: ignore[arg-type]
    scenes = [number // VIEWS for number in numbers.read]
    assert [scenes[k] for k in range(0, 30, VIEWS)] == [scenes[k + 2] for k in range(0, 30, VIEWS)]
    assert handed != numbers.read


def process_of(number: int) -> int:
    return os.getpid()


@pytest.mark.slow
def test_workers_of_an_epoch_work_in_the_next_one_even_after_a_break() -> None:
    """Starting them takes seconds; none is this process."""
    numbers: Any = Numbers(12)
    loader = gen_data.Loader(numbers, process_of, batch_size=6, workers=1)
    first, second = (set(flat(loader)) for _ in range(2))
    next(iter(loader))
    third = set(flat(loader))
    assert first == second == third
    assert len(first) == 1
    assert os.getpid() not in first


@pytest.mark.parametrize(
    ("options", "text"),
    [({"batch_size": 0}, "batch_size: 0; expected at least 1"),
     ({"rank": 2, "world_size": 2}, "rank: 2; expected 0 to 1"),
     ({"epoch_size": 5}, "epoch_size: expected for a data set without a size")],
)  # fmt: skip
def test_wrong_arguments_are_refused(options: Any, text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        loader(**options)
    state = loader(seed=1).state_dict()
    with pytest.raises(ConfigError, match="seed 1, this one has 2"):
        loader(seed=2).load_state_dict(state)
