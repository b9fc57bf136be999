"""What a line of the tables is: a named generator of objects, textures or environments."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from generator.core.geometry import ConvexParts, Float32, MeshData, TextureData


@dataclass(frozen=True, eq=False, slots=True)
class Solid:
    """One object: what is seen of it and what collides.

    Attributes:
        mesh: Visual geometry in the object's frame.
        collision: Convex parts in the same frame.
    """

    mesh: MeshData
    collision: ConvexParts


@dataclass(frozen=True)
class Family:
    """A generator of similar objects.

    Attributes:
        name: What ids start with: ``mug`` in ``mug?seed=3``.
        category: What its objects are called in labels.
        tags: What YAML selects by, sorted.
        variants: ``build(seed=k)`` is an object for ``k`` in ``range(variants)``; 0 = the family
            is parametric: ``build(**parameters)``.
        mass_kg: Nominal mass; 0 = does not move.
        stackable: Flat above and below.
        version: Raised whenever the same arguments make other bytes.
        parameters: ``{name: default}`` of a parametric family.
        build: Pure function of its arguments.
    """

    name: str
    category: str
    tags: tuple[str, ...]
    variants: int
    mass_kg: float
    stackable: bool
    version: int
    parameters: Mapping[str, object]
    build: Callable[..., Solid]


@dataclass(frozen=True)
class TextureFamily:
    """A generator of textures; ``build(seed)`` is a pure function.

    Attributes:
        variants: Seeds ``range(variants)`` are offered for selection; any other seed works too.
    """

    name: str
    tags: tuple[str, ...]
    variants: int
    version: int
    build: Callable[[int], TextureData]


@dataclass(frozen=True)
class EnvironmentFamily:
    """A generator of equirectangular images of relative luminance; see ``AssetLibrary``."""

    name: str
    tags: tuple[str, ...]
    variants: int
    version: int
    build: Callable[[int], Float32]


@dataclass(frozen=True)
class Lazy:
    """A function named by ``module:function`` and imported when first called.

    Attributes:
        path: Module relative to this package, and the function in it.
    """

    path: str

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the function."""
        module, _, function = self.path.partition(":")
        package = __name__.rpartition(".")[0]
        return getattr(importlib.import_module(f"{package}.{module}"), function)(*args, **kwargs)
