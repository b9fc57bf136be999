"""Analytic skies with sun and clouds."""

from __future__ import annotations

from collections.abc import Mapping

from generator.assets.procedural.family import EnvironmentFamily

ENVIRONMENTS: Mapping[str, EnvironmentFamily] = {}
