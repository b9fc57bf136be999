"""Caches never exceed their bounds; the least recently used values go first, or unused ones."""

import numpy as np

from gen_data.core.bounded_cache import ByteCache, CountCache, HeldCache


def test_bytes_are_bounded_whatever_the_sizes_and_a_larger_value_displaces_all() -> None:
    """A thousand arrays of up to 400 bytes, at most 1,000 bytes of them at a time."""
    cache: ByteCache[np.ndarray] = ByteCache(1000)
    for k in range(1000):
        size = 8 * (k % 50 + 1)
        assert cache.get(str(k), lambda size=size: np.zeros(size, np.uint8)).nbytes == size
        held = [cache.get(name, lambda: np.zeros(1)).nbytes for name in list(cache._values)]
        assert sum(held) <= 1000

    cache.get("small", lambda: np.zeros(100, np.uint8))
    cache.get("large", lambda: np.zeros(5000, np.uint8))

    assert len(cache) == 1


def test_the_value_used_longest_ago_goes_first() -> None:
    """Two of 4 bytes fit into 10."""
    cache: ByteCache[np.ndarray] = ByteCache(10)
    made: list[str] = []
    for name in "abacab":
        cache.get(name, lambda name=name: made.append(name) or np.zeros(4, np.uint8))
    assert made == ["a", "b", "c", "b"]


def test_small_values_are_bounded_by_number_too() -> None:
    """Four of them, although thousands would fit."""
    cache: ByteCache[np.ndarray] = ByteCache(1_000_000, limit=4)
    for k in range(1000):
        cache.get(str(k), lambda: np.zeros(10, np.uint8))

    assert list(cache._values) == ["996", "997", "998", "999"]


def test_values_are_bounded_by_number_and_the_oldest_go() -> None:
    """Three fit; the one requested again stays."""
    cache: CountCache[int] = CountCache(3)
    made: list[str] = []

    def get(name: str) -> int:
        def make() -> int:
            made.append(name)
            return len(made)

        return cache.get(name, make)

    assert [get(name) for name in "abcad"] == [1, 2, 3, 1, 4]
    assert [name in cache for name in "abcd"] == [True, False, True, True]
    assert get("b") == 5
    assert len(cache) == 3


def test_a_value_lives_as_long_as_somebody_holds_it() -> None:
    """Meanwhile everybody gets the same one."""
    cache: HeldCache[set[str]] = HeldCache()

    class Value(set[str]):
        """A set that weak references can refer to."""

    made: list[str] = []

    def get(name: str) -> set[str]:
        return cache.get(name, lambda: made.append(name) or Value(name))

    one, other = get("a"), get("b")
    assert get("a") is one
    del other
    assert len(cache) == 1
    assert get("b") == {"b"}
    assert made == ["a", "b", "b"]
