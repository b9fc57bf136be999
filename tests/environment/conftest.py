"""Environments end with their test; those that tests share, with the last test of a file."""

from collections.abc import Iterator

import pytest

from tests.environment.small import OPENED, nominal


@pytest.fixture(autouse=True)
def environments_end_with_their_test() -> Iterator[None]:
    """Those that ``small`` has opened."""
    yield
    while OPENED:
        OPENED.pop().close()


@pytest.fixture(autouse=True, scope="module")
def shared_environments_end_with_their_file() -> Iterator[None]:
    """Those that ``nominal`` keeps; the garbage collector ends them."""
    yield
    nominal.cache_clear()
