"""Families: named generators of objects, textures and environments, and their tables."""

import importlib
import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

from gen_data.assets.content import content
from gen_data.config.data_files import load_data
from gen_data.core import asset_types, errors, se3, variant_rng


@dataclass(frozen=True, eq=False, slots=True)
class Solid:
    """One object: visual mesh, collision geometry and keypoints.

    Attributes:
        mesh: Visual geometry in the object's frame.
        collision: Convex parts in the same frame.
        keypoints: Named points in the same frame.
        body_bounds_m: Bounds of the mesh without a vehicle's exterior mirrors or a pole's cables,
            smallest and largest coordinates [m]; None if it has none.
    """

    mesh: asset_types.MeshData
    collision: asset_types.ConvexParts
    keypoints: tuple[asset_types.Keypoint, ...] = ()
    body_bounds_m: tuple[se3.Vec3, se3.Vec3] | None = None


@dataclass(frozen=True, slots=True)
class Provenance:
    """Source and licence of an asset."""

    licence: str
    author: str
    source: str


OURS = Provenance("Apache-2.0", "gen-data contributors", "gen-data (procedural)")


@dataclass(frozen=True, slots=True)
class Facts:
    """Facts about an object that need no mesh.

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
        name: First part of its ids: ``mug`` in ``mug?seed=3``.
        category: Category of its objects in labels.
        tags: Sorted words that configurations select it by.
        variants: ``build(seed=k)`` is an object for ``k`` in ``range(variants)``; 0 = the family
            is parametric: ``build(**parameters)``.
        mass_kg: Nominal mass; 0 = does not move.
        stackable: Flat above and below.
        version: Raised whenever the same arguments make other bytes.
        parameters: ``{name: default}`` of a parametric family.
        build: Pure function of its arguments.
        facts: Pure, quick function of the same arguments; None = no further facts.
        declares: Facts for those who place or change its objects, by name; values, or functions
            and tables as ``Lazy``. Labels do not contain them.
        symmetries: The same for turns that leave the object as it looks; None = there are none.
        stored: Whether the disk cache also keeps results that are not offered for selection;
            false where few are used twice.
        stored_parameters: Parameters that stored results may nevertheless have besides a seed.
        origin: Source and licence, if not all is ours.
        about: One line on its objects; empty = first line of the docstring of ``build``.
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
    stored_parameters: tuple[str, ...] = ()
    origin: Provenance = OURS
    symmetries: Callable[..., tuple[asset_types.Symmetry, ...]] | None = None
    declares: Mapping[str, object] = field(default_factory=dict)
    about: str = ""


@dataclass(frozen=True)
class ImageFamily:
    """A generator of images; ``build(seed, **parameters)`` is a pure function.

    Attributes:
        variants: Seeds ``range(variants)`` are offered for selection; any other seed works too.
        stored: Whether the disk cache also keeps images that are not offered for selection;
            false where few are used twice.
        stored_parameters, declares: As of objects.
        origin: Source and licence, if it is not ours.
    """

    name: str
    tags: tuple[str, ...]
    variants: int
    version: int
    build: Callable[..., Any]
    parameters: Mapping[str, object] = field(default_factory=dict)
    stored: bool = True
    stored_parameters: tuple[str, ...] = ()
    origin: Provenance = OURS
    declares: Mapping[str, object] = field(default_factory=dict)


class TextureFamily(ImageFamily):
    """A generator of textures: ``TextureData``."""


class EnvironmentFamily(ImageFamily):
    """A generator of equirectangular images of relative luminance; see ``AssetLibrary``."""


@dataclass(frozen=True)
class Lazy:
    """A function or another value named by ``module:name``, imported when first used.

    Attributes:
        path: Full name of the module, and the name in it.
        arguments: Arguments that calls of the function do not give, by name.
    """

    path: str
    arguments: Mapping[str, object] = field(default_factory=dict, hash=False)

    @property
    def value(self) -> Any:
        """The named value."""
        module, _, name = self.path.partition(":")
        return getattr(importlib.import_module(module), name)

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the function."""
        return self.value(*args, **self.arguments, **kwargs)


@dataclass(frozen=True)
class Builder(Lazy):
    """The builder function of a family; if it takes ``rng``, the family draws by it.

    Attributes:
        family: Name of the family; with the seed, it decides all draws.
    """

    family: str = ""

    def __call__(self, *args: Any, **arguments: Any) -> Any:
        """The object or image of a seed, or of other arguments."""
        if "rng" in inspect.signature(self.value).parameters:
            (seed,) = args or (arguments.pop("seed"),)
            args = (variant_rng.variant_rng(self.family, seed),)
        return super().__call__(*args, **arguments)


@dataclass(frozen=True)
class Worn:
    """A generator whose objects are worn, more or less by seed.

    Attributes:
        build: The generator of objects as new.
        name: Name of the family.
        wear: Function of the object, the name and the seed: the object in use.
    """

    build: Callable[..., Solid]
    name: str
    wear: Callable[[Solid, str, int], Solid]

    def __call__(self, seed: int, **parameters: Any) -> Solid:
        """The object in use."""
        return self.wear(self.build(seed=seed, **parameters), self.name, seed)


@dataclass(frozen=True)
class ConstantFacts:
    """Facts that are the same for every variant."""

    subcategory: str

    def __call__(self, **_: Any) -> Facts:
        """The facts, whatever the arguments."""
        return Facts(self.subcategory)


@dataclass(frozen=True)
class DrawnFacts:
    """Choices that the variants of a family take in turn, whatever its other parameters are.

    Attributes:
        subcategory: A constant, or the options of the choice by the name of its draw.
        options: Options of attributes by the name of the draw.
    """

    family: str
    subcategory: str | Mapping[str, Lazy]
    options: Mapping[str, Lazy]

    def __call__(self, seed: int, **_: Any) -> Facts:
        """The facts of a variant."""
        rng = variant_rng.variant_rng(self.family, seed)

        def choose(options: Mapping[str, Lazy]) -> dict[str, str]:
            return {name: rng.turn(tuple(lazy.value), name) for name, lazy in options.items()}

        kind = self.subcategory
        kind = kind if isinstance(kind, str) else next(iter(choose(kind).values()))
        return Facts(kind, choose(self.options))


@dataclass(frozen=True)
class ConstantSymmetries:
    """Symmetries that are the same for every variant.

    Attributes:
        folds: Fold by axis ``x``, ``y`` or ``z``; see ``Symmetry``.
    """

    folds: Mapping[str, int]

    def __call__(self, **_: Any) -> tuple[asset_types.Symmetry, ...]:
        """The symmetries, whatever the arguments."""
        return axis_symmetries(**self.folds)


def axis_symmetries(**folds: int) -> tuple[asset_types.Symmetry, ...]:
    """Symmetries about axes of the object's frame, by name: ``z=0`` is any turn about Z."""
    return tuple(asset_types.Symmetry(_AXES[name], fold) for name, fold in folds.items())


_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def choose_option(
    family: str, parameter: str, value: str, options: Sequence[str], seed: int
) -> str:
    """The value of a parameter; ``any`` takes the options in turn by seed.

    Raises:
        AssetError: if it is neither ``any`` nor one of the options.
    """
    if value == "any":
        return variant_rng.in_turn(options, seed)
    check_option(family, parameter, value, ("any", *options))
    return value


def check_option(family: str, parameter: str, value: str, options: Iterable[str]) -> None:
    """Raise AssetError if a parameter of a family has none of the values that it may have."""
    if value not in options:
        raise errors.AssetError(
            f"{family}: {parameter}={value} is unknown; expected one of {', '.join(options)}"
            f"{errors.did_you_mean(value, options)}"
        )


class FamilyTables(NamedTuple):
    """The families of one package, by name."""

    objects: Mapping[str, Family]
    textures: Mapping[str, TextureFamily]
    environments: Mapping[str, EnvironmentFamily]


def load_families(package: str) -> FamilyTables:
    """The tables in ``families.yaml`` of a package; the file's own header explains its keys."""
    plain = load_data(package, "families")

    def table(section: str, make: Callable[..., Any]) -> Mapping[str, Any]:
        rows = plain.get(section, {})
        return {name: make(name, **_arguments(package, name, row)) for name, row in rows.items()}

    return FamilyTables(
        table("objects", _object_family),
        table("textures", TextureFamily),
        table("environments", EnvironmentFamily),
    )


def _object_family(
    name: str,
    *,
    category: str = "",
    subcategory: str | Mapping[str, Lazy] = "",
    facts: bool | Mapping[str, Lazy] = False,
    marks: Mapping[int | str, str] | None = None,
    wear: Callable[[Solid, str, int], Solid] | None = None,
    **row: Any,
) -> Family:
    known: Callable[..., Facts] | None = None
    if facts is True:
        known = replace(row["build"], path=f"{row['build'].path}_facts")
    elif facts or not isinstance(subcategory, str):
        known = DrawnFacts(name, subcategory, facts or {})
    elif subcategory:
        known = ConstantFacts(subcategory)
    row = {"mass_kg": 0.0, "stackable": False, **row}
    if marks:
        row["build"] = Worn(row["build"], name, partial(Lazy(content().USE_MARKS), marks=marks))
    elif wear:
        row["build"] = Worn(row["build"], name, wear)
    return Family(name=name, category=category or name, facts=known, **row)


def _arguments(package: str, name: str, row: Mapping[str, Any]) -> dict[str, Any]:
    """A row of the table as keywords: lists become tuples, ``build`` a function.

    Facts and symmetries take the arguments that ``build: {use: ...}`` fixes, as ``build`` does.
    """
    build = row["build"]
    use, *fixed = build.items() if isinstance(build, Mapping) else (("use", build),)
    parameters = {
        key: tuple(value) if isinstance(value, list) else value
        for key, value in row.get("parameters", {}).items()
    }
    return {
        "version": 1,
        "variants": 0,
        **row,
        "build": Builder(_lazy(package, use[1]).path, dict(fixed), name),
        "tags": tuple(sorted(row["tags"])),
        **({"wear": _lazy(package, row["wear"])} if "wear" in row else {}),
        "parameters": parameters,
        "declares": {key: _fact(package, value) for key, value in row.get("declares", {}).items()},
        **{key: _facts(package, row[key]) for key in ("facts", "subcategory") if key in row},
        **_symmetries(package, row.get("symmetries"), dict(fixed)),
    }


def _lazy(package: str, path: str) -> Lazy:
    """A value named by a full path, or by a path in the package of the table."""
    return Lazy(path if path.startswith("gen_data.") else f"{package}.{path}")


def _facts(package: str, given: bool | str | Mapping[str, str]) -> bool | str | Mapping[str, Lazy]:
    """Whether there is a function of facts, a subcategory, or the options by name of the draw."""
    if not isinstance(given, Mapping):
        return given
    return {name: _lazy(package, path) for name, path in given.items()}


def _fact(package: str, value: Any) -> Any:
    """A declared fact: lists become tuples, ``module:name`` is imported when it is used."""
    if isinstance(value, list):
        return tuple(value)
    return _lazy(package, value) if isinstance(value, str) and ":" in value else value


def _symmetries(
    package: str, given: str | Mapping[str, int] | None, fixed: Mapping[str, object]
) -> dict[str, Any]:
    """A function for ``module:function``, or for folds by axis; nothing for None."""
    if given is None:
        return {}
    if isinstance(given, str):
        return {"symmetries": replace(_lazy(package, given), arguments=fixed)}
    return {"symmetries": ConstantSymmetries(given)}
