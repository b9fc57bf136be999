"""What a line of the tables is: a named generator of objects, textures or environments."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from generator.core.geometry import ConvexParts, Float32, Keypoint, MeshData, TextureData


@dataclass(frozen=True, eq=False, slots=True)
class Solid:
    """One object: what is seen of it and what collides.

    Attributes:
        mesh: Visual geometry in the object's frame.
        collision: Convex parts in the same frame.
        keypoints: Named points in the same frame.
    """

    mesh: MeshData
    collision: ConvexParts
    keypoints: tuple[Keypoint, ...] = ()


@dataclass(frozen=True, slots=True)
class Origin:
    """Where an asset comes from, and on which terms."""

    licence: str
    author: str
    source: str


OURS = Origin("Apache-2.0", "gen-data contributors", "gen-data (procedural)")


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known of an object without building it.

    Attributes:
        subcategory: A finer name than the category.
        attributes: Further facts that labels carry.
    """

    subcategory: str = ""
    attributes: Mapping[str, str] = field(default_factory=dict)


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
        facts: Pure and quick function of the same arguments; None = nothing more is known.
        stored: Whether the disk also keeps results that are not offered for selection; not if
            hardly any is asked for twice.
        origin: Where it comes from, if it is not all ours.
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
    facts: Callable[..., Facts] | None = None
    stored: bool = True
    origin: Origin = OURS


@dataclass(frozen=True)
class TextureFamily:
    """A generator of textures; ``build(seed, **parameters)`` is a pure function.

    Attributes:
        variants: Seeds ``range(variants)`` are offered for selection; any other seed works too.
        origin: Where it comes from, if it is not ours.
    """

    name: str
    tags: tuple[str, ...]
    variants: int
    version: int
    build: Callable[..., TextureData]
    parameters: Mapping[str, object] = field(default_factory=dict)
    origin: Origin = OURS


@dataclass(frozen=True)
class EnvironmentFamily:
    """A generator of equirectangular images of relative luminance; see ``AssetLibrary``.

    ``build(seed, **parameters)`` is a pure function.

    Attributes:
        stored: Whether the disk also keeps images that are not offered for selection; not if
            hardly any is asked for twice.
        origin: Where it comes from, if it is not ours.
    """

    name: str
    tags: tuple[str, ...]
    variants: int
    version: int
    build: Callable[..., Float32]
    parameters: Mapping[str, object] = field(default_factory=dict)
    stored: bool = True
    origin: Origin = OURS


@dataclass(frozen=True)
class Lazy:
    """A function named by ``module:function`` and imported when first called.

    Attributes:
        path: Module relative to this package, or its full name, and the function in it.
    """

    path: str

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the function."""
        module, _, function = self.path.partition(":")
        if not module.startswith("generator."):
            module = f"{__package__}.{module}"
        return getattr(importlib.import_module(module), function)(*args, **kwargs)
