"""Roads and junctions: lane graphs, their surfaces, and OpenDRIVE files."""

from __future__ import annotations

from collections.abc import Mapping

from generator.assets.procedural.family import Family

FAMILIES: Mapping[str, Family] = {}
