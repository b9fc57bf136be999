"""Cars, vans, trucks, buses, motorcycles and bicycles."""

from __future__ import annotations

from collections.abc import Mapping

from generator.assets.procedural.family import Family

FAMILIES: Mapping[str, Family] = {}
