"""Former names of modules, ``gen_data.generator.core`` for ``gen_data.core``, until release 1.0."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

__path__: list[str] = []
_LAB = re.compile(r"^(certificate|environment|matching|study)\b")
_CONTENT = re.compile(r"^assets\.(interiors|people|procedural|roads|scenery|skies|vehicles)\b")


class _Former(MetaPathFinder, Loader):
    """Finds modules by their former names; both names are one module."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        del path, target
        return ModuleSpec(fullname, self) if fullname.startswith(f"{__name__}.") else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        name = spec.name.removeprefix(f"{__name__}.")
        name = _CONTENT.sub(r"content.\1", _LAB.sub(r"lab.\1", name))
        module = import_module(f"gen_data.{name}")
        # The import system is about to replace it.
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        spec = module.__spec__
        assert spec is not None
        module.__spec__ = spec.loader_state


# Before the finder of files, which would load a module a second time.
sys.meta_path.insert(0, _Former())
warnings.warn(
    "gen_data.generator: its modules are below gen_data now; see docs/migration.md",
    DeprecationWarning,
    stacklevel=2,
)
