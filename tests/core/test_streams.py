"""Random streams: keyed by who draws, never by when."""

from dataclasses import replace
from hashlib import blake2b

import numpy as np
import pytest
from scipy import stats

from gen_data.core.streams import Streams

BASE = Streams(seed=7, scene=3, view=1, attempt=0, index=16)


def first(streams: Streams, name: str = "lighting/sun") -> float:
    return streams.rng(name).random()


def test_drawing_elsewhere_moves_nothing() -> None:
    """A randomizer can be inserted, removed or moved without changing the draws of others."""
    alone = BASE.rng("lighting/sun").random(3)

    BASE.rng("materials/finish").random(1000)
    assert (alone == BASE.rng("lighting/sun").random(3)).all()


@pytest.mark.parametrize("other", [
    replace(BASE, seed=8), replace(BASE, scene=4), replace(BASE, view=2), replace(BASE, attempt=1),
    replace(BASE, view=-1),
])  # fmt: skip
def test_each_part_of_the_key_matters(other: Streams) -> None:
    assert first(other) != first(BASE)


def test_different_keys_draw_different_numbers() -> None:
    """Scene 1, view 11 is not scene 11, view 1; seed 0 is a seed."""
    assert first(BASE, "lighting/sun") != first(BASE, "lighting/lamp")
    assert first(Streams(1, 1, 11)) != first(Streams(1, 11, 1))
    assert first(Streams(11, 1, 1)) != first(Streams(1, 11, 1))
    assert first(Streams(0, 0)) == first(Streams(0, 0))
    assert first(Streams(0, 0)) != first(Streams(1, 0))


def test_the_index_is_carried_but_draws_nothing() -> None:
    other = replace(BASE, index=99)

    assert other.rng("a").index == 99
    assert first(other) == first(BASE)


def test_the_construction_is_pinned() -> None:
    """Philox, keyed by 128 bits of BLAKE2b over the NUL-joined parts, little-endian."""
    key = int.from_bytes(blake2b(b"7\x003\x001\x000\x00a", digest_size=16).digest(), "little")
    raw = np.random.Philox(key=key).random_raw(4)

    # A uniform double is the upper 53 bits of one raw number.
    assert (BASE.rng("a").random(4) == (raw >> np.uint64(11)) * 2.0**-53).all()
    assert BASE.rng("a").random() == 0.5097130843568609


def test_numbers_of_neighbouring_scenes_are_independent() -> None:
    """First draws of 4,096 scenes: uniform, no serial correlation; false-alarm rate 1e-4 each."""
    values = np.array([first(Streams(0, scene)) for scene in range(4096)])

    assert stats.kstest(values, stats.uniform.cdf).pvalue > 1e-4
    assert stats.pearsonr(values[:-1], values[1:]).pvalue > 1e-4
