"""Bodies that tests of people are run on."""

from __future__ import annotations

import pytest

from generator.assets.people.body import Body, load
from generator.assets.people.families import pack_file
from generator.assets.people.simple import simple_body

NEEDS_PACK = pytest.mark.skipif(
    not pack_file().is_file(), reason="the people pack is not installed"
)
KINDS = [
    pytest.param("simple", id="simple"),
    pytest.param("pack", id="pack", marks=NEEDS_PACK),
]


def body_of(kind: str) -> Body:
    """The body of a kind."""
    return simple_body() if kind == "simple" else load(pack_file())
