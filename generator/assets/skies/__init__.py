"""Analytic skies with sun and clouds."""

from __future__ import annotations

from gen_data.generator.assets.procedural.family import load_families

ENVIRONMENTS = load_families(__name__).environments
