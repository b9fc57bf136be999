"""The seam between the core and its content: the tables of ``content``."""

import importlib
from types import ModuleType


def content() -> ModuleType:
    """The package of content."""
    return importlib.import_module("gen_data.content")
