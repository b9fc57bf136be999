"""Procedural assets: objects, textures and environments computed from a seed or a size.

A new generator is one function and one line of ``families.yaml``; it is imported when first built.
Its colours, words, dimensions and designs are rows of YAML files in its folder (``data_tables``).
"""

from gen_data.assets.family import load_families

FAMILIES, TEXTURES, ENVIRONMENTS = load_families(__name__)
