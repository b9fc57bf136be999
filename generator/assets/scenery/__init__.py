"""What lines a street: buildings, plants, street furniture, traffic lights and signs."""

from __future__ import annotations

from collections.abc import Mapping

from generator.assets.procedural.family import Family

FAMILIES: Mapping[str, Family] = {}
