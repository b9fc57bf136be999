"""Posed, clothed people with keypoints."""

from __future__ import annotations

from collections.abc import Mapping

from generator.assets.procedural.family import Family

FAMILIES: Mapping[str, Family] = {}
