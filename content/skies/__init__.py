"""Analytic skies with sun and clouds."""

from __future__ import annotations

from gen_data.assets.family import load_families

ENVIRONMENTS = load_families(__name__).environments
