"""Former names of modules, ``gen_data.generator.core`` for ``gen_data.core``, until release 1.0."""

import re
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

__path__: list[str] = []
_MOVED = (
    (r"^assets\.procedural\.noise$", "core.noise"),
    (r"^assets\.procedural\.data_tables$", "config.data_files"),
    (r"^assets\.procedural\.family$", "assets.family"),
    (r"^assets\.procedural\.variant_rng$", "core.variant_rng"),
    (r"^assets\.skies\.(clouds|daylight|equirectangular|sky)$", r"sky.\1"),
    (r"^assets\.(interiors|people|procedural|roads|scenery|skies|vehicles)\b", r"content.\1"),
    (
        r"^packs\.(example_robot_data|mjcf|panoramas|pybullet_files|robosuite|sweethome3d)$",
        r"content.packs.\1",
    ),
    (r"^(certificate|environment|matching|study)\b", r"lab.\1"),
)
"""Patterns of names and their successors; the first that matches decides."""


class _Former(MetaPathFinder, Loader):
    """Finds modules by their former names; both names are one module."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        del path, target
        return ModuleSpec(fullname, self) if fullname.startswith(f"{__name__}.") else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        name = spec.name.removeprefix(f"{__name__}.")
        new = (re.sub(old, to, name) for old, to in _MOVED if re.match(old, name))
        module = import_module(f"gen_data.{next(new, name)}")
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
