"""Tables of content; see ``generator/config/data_files.py``."""

from __future__ import annotations

from gen_data.generator.config.data_files import load_table

__all__ = ["load_table"]
