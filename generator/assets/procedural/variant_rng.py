"""Random draws of one variant; see ``generator/core/variant_rng.py``."""

from __future__ import annotations

from gen_data.generator.core.variant_rng import VariantRng, in_turn, variant_rng

__all__ = ["VariantRng", "in_turn", "variant_rng"]
