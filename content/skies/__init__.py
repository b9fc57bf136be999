"""Analytic skies with sun and clouds."""

from gen_data.assets.family import load_families

ENVIRONMENTS = load_families(__name__).environments
