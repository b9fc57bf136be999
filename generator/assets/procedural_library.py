"""Procedural assets: families of objects, textures and environments."""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, TypeVar

from gen_data.assets import asset_arrays, asset_cache, drape, family_parameters, importer
from gen_data.assets.asset_ids import AssetId, ParameterValue, format_parameter
from gen_data.assets.families import AnyFamily, kind_of, own_families, third_party_families
from gen_data.assets.family import EnvironmentFamily, Facts, Family, TextureFamily
from gen_data.core import activity
from gen_data.core.asset_types import Asset, AssetFacts, Float32, Symmetry, TextureData
from gen_data.core.bounded_cache import CountCache, Sized
from gen_data.core.errors import AssetError, did_you_mean
from gen_data.core.variant_rng import Draw, drawing
from gen_data.core.writing import Writing, recording

VERSION = 4
"""Increased whenever code shared by all families generates different geometry."""
_KEYS = 8192
"""Content keys kept in memory, some hundred bytes each."""
_MAX_SEED = 2**31 - 1
_offered: CountCache[tuple[AnyFamily, Asset]] = CountCache(16384)
"""Descriptions of assets offered for selection, about 1 kB each: every library of a process has the
same, each search by tags finds many of them, and their facts take a millisecond."""
S = TypeVar("S", bound=Sized)
T = TypeVar("T")
F = TypeVar("F", Family, TextureFamily, EnvironmentFamily)


class ProceduralLibrary:
    """Part of the library that needs no file. Names are the part of ids before ``?``."""

    def __init__(self, store: asset_cache.Store) -> None:
        self._store = store
        others = third_party_families()
        own = own_families()
        self._packages = {name: package for name, (_, package) in others.items() if name not in own}
        self._families = {**own, **{name: others[name][0] for name in self._packages}}
        self._keys: CountCache[str] = CountCache(_KEYS)

    def __contains__(self, name: str) -> bool:
        """Whether a family has that name."""
        return name in self._families

    def names(self) -> Iterator[str]:
        """Yield every id offered for selection, and the names of families that need parameters."""
        for name, family in self._families.items():
            yield from [f"{name}?seed={k}" for k in range(family.variants)] or [name]

    def find(self, tags: frozenset[str], kind: str) -> Iterator[Asset]:
        """Yield the assets offered for selection of a kind that have every tag."""
        for name, family in self._families.items():
            if tags.issubset(_list_tags(name, family)):
                yield from self.variants(name, kind)

    def variants(self, name: str, kind: str) -> Iterator[Asset]:
        """Yield the assets offered for selection of a family with a known name, if of that kind."""
        family = self._families[name]
        if kind_of(family) == kind:
            for k in range(family.variants):
                yield self.get(AssetId(name, {"seed": k}))

    def get(self, asset_id: AssetId) -> Asset:
        """Describe the asset of an id with a known name. Raises AssetError on wrong parameters."""
        family = self._families[asset_id.name]
        parts = self._split_draped(asset_id)
        if parts:
            level = self.get(parts[0])
            digest = _draped_key(level.sha256, parts[1], str(family.declares[drape.FACT]))
            return replace(level, asset_id=str(asset_id), sha256=digest)
        if not _is_offered(asset_id, family):
            return self._describe(asset_id, family)
        # The family is held next to its id(), which no other object can have as long.
        name = f"{id(family)}/{asset_id}"
        return _offered.get(name, lambda: (family, self._describe(asset_id, family)))[1]

    def draws(self, asset_id: AssetId) -> dict[str, Draw]:
        """Named draws of an asset with a known name, in their order; makes the asset."""
        try:
            return _make_and_list(asset_id, self._families[asset_id.name])[1]
        except ValueError as error:
            raise AssetError(f"asset '{asset_id}': {error}") from error

    def parameters(self, name: str, variants: int) -> tuple[family_parameters.FamilyParameter, ...]:
        """Named draws of the first variants of a family with a known name, which are made."""
        seeds = range(min(self._families[name].variants, variants))
        return family_parameters.merge_draws(self.draws(AssetId(name, {"seed": k})) for k in seeds)

    def _describe(self, asset_id: AssetId, family: AnyFamily) -> Asset:
        if _merge_arguments(asset_id, family)[1]:
            # Possible values depend on other draws: only making the asset finds wrong ones.
            _MAKE[kind_of(family)](self, asset_id)
        facts = _Facts(asset_id, family)
        if not _is_offered(asset_id, family):
            facts()  # Finds values that are impossible.
        origin = family.origin
        return Asset(
            asset_id=str(asset_id),
            kind=kind_of(family),
            category=family.category if isinstance(family, Family) else family.name,
            tags=_list_tags(asset_id.name, family),
            licence=origin.licence,
            author=origin.author,
            source=origin.source,
            sha256=self._key(asset_id, family),
            mass_kg=family.mass_kg if isinstance(family, Family) else 0.0,
            stackable=isinstance(family, Family) and family.stackable,
            facts=facts,
        )

    def imported(self, asset_id: AssetId) -> importer.ImportedMesh:
        """Geometry of an object."""
        family = self._find(asset_id, Family, "an object")
        parts = self._split_draped(asset_id)
        if parts:
            level, place = parts
            kind = str(family.declares[drape.FACT])
            key = _draped_key(self._key(level, family), place, kind)
            return self._store.computed(key, lambda: drape.drape(self.imported(level), place, kind))

        def compute() -> importer.ImportedMesh:
            solid = _make(asset_id, family)
            return importer.ImportedMesh(
                solid.mesh, solid.collision, {}, solid.keypoints, solid.body_bounds_m
            )

        return self._result(
            asset_id, family, compute, asset_arrays.pack_imported, asset_arrays.unpack_imported
        )

    def texture(self, asset_id: AssetId) -> TextureData:
        """Images of a texture."""
        family = self._find(asset_id, TextureFamily, "a texture")
        compute: Callable[[], TextureData] = partial(_make, asset_id, family)
        return self._result(
            asset_id, family, compute, asset_arrays.pack_texture, asset_arrays.unpack_texture
        )

    def writing(self, asset_id: AssetId) -> asset_cache.Arrays:
        """Lines of text as ``pack_writing`` has them; makes a texture.

        Of a family that declares ``writing``.
        """
        family, parts = self._families[asset_id.name], self._split_draped(asset_id)
        try:
            if parts:
                level = _lines_of_object(parts[0], family)
                lines = [replace(w, quads=drape.raised(w.quads, parts[1])) for w in level]
            elif isinstance(family, Family):
                lines = _lines_of_object(asset_id, family)
            else:
                with recording() as lines:
                    _make(asset_id, family)
        except ValueError as error:
            raise AssetError(f"asset '{asset_id}': {error}") from error
        return asset_arrays.pack_writing(lines)

    def environment(self, asset_id: AssetId) -> Float32:
        """Pixels of an environment."""
        family = self._find(asset_id, EnvironmentFamily, "an environment")
        compute: Callable[[], Float32] = partial(_make, asset_id, family)
        pack, unpack = (lambda image: {"radiance": image}), (lambda arrays: arrays["radiance"])
        return self._result(asset_id, family, compute, pack, unpack)

    def is_stored(self, asset_id: AssetId) -> bool:
        """Whether the asset is kept on disk: others are too many, or quick to compute."""
        family = self._families[asset_id.name]
        if self._split_draped(asset_id):
            return False
        is_kept = set(asset_id.parameters) <= {"seed", *family.stored_parameters}
        return family.stored or (family.variants > 0 and is_kept)

    def _split_draped(self, asset_id: AssetId) -> tuple[AssetId, AssetId] | None:
        """See ``drape.split_draped``; None for families that do not lie on the ground."""
        family = self._families[asset_id.name]
        if drape.FACT not in family.declares:
            return None
        return drape.split_draped(asset_id)

    def _find(self, asset_id: AssetId, kind: type[F], expected: str) -> F:
        """The id's family. Raises AssetError if it is of another kind."""
        family = self._families[asset_id.name]
        if not isinstance(family, kind):
            raise AssetError(f"asset '{asset_id}': is of kind {kind_of(family)}, not {expected}")
        return family

    def _result(
        self,
        asset_id: AssetId,
        family: AnyFamily,
        compute: Callable[[], S],
        pack: Callable[[S], asset_cache.Arrays],
        unpack: Callable[[asset_cache.Arrays], S],
    ) -> S:
        key = self._key(asset_id, family)
        try:
            if not self.is_stored(asset_id):
                return self._store.computed(key, compute)
            return self._store.get(key, lambda: pack(compute()), unpack)
        except ValueError as error:
            raise AssetError(f"asset '{asset_id}': {error}") from error

    def _key(self, asset_id: AssetId, family: AnyFamily) -> str:
        return self._keys.get(str(asset_id), lambda: self._content_key(asset_id, family))

    def _content_key(self, asset_id: AssetId, family: AnyFamily) -> str:
        arguments, asked = _merge_arguments(asset_id, family)
        given = {**arguments, **asked}
        parameters = {name: format_parameter(value) for name, value in given.items()}
        version = [VERSION, family.version]
        content = {"family": asset_id.name, "version": version, "parameters": parameters}
        if asset_id.name in self._packages:
            # Another release of a package, or another package, may use the same version number.
            content["package"] = self._packages[asset_id.name]
        return asset_cache.content_key(content)


def _draped_key(level: str, place: AssetId, kind: str) -> str:
    content = {"level": level, "place": str(place), "kind": kind, "version": drape.VERSION}
    return asset_cache.content_key(content)


def _lines_of_object(asset_id: AssetId, family: AnyFamily) -> list[Writing]:
    """Lines on a mesh, by the function that its family declares."""
    write = family.declares["writing"]
    assert callable(write), "of objects it is a function"
    return list(_call(write, asset_id, family)[0])


def _is_offered(asset_id: AssetId, family: AnyFamily) -> bool:
    """Whether an asset is one of the family's seeds that are offered for selection."""
    seed = asset_id.parameters.get("seed")
    return len(asset_id.parameters) == 1 and type(seed) is int and 0 <= seed < family.variants


@dataclass(frozen=True)
class _Facts:
    """Facts about an asset, found when they are first asked for."""

    asset_id: AssetId
    family: AnyFamily

    def __call__(self) -> AssetFacts:
        """The facts."""
        return self._found

    @cached_property
    def _found(self) -> AssetFacts:
        facts = _read_facts(self.asset_id, self.family)
        attributes = tuple(sorted(facts.attributes.items()))
        return AssetFacts(
            facts.subcategory, attributes, _list_symmetries(self.asset_id, self.family)
        )


def _read_facts(asset_id: AssetId, family: AnyFamily) -> Facts:
    if not isinstance(family, Family) or family.facts is None:
        return Facts()
    return _call(family.facts, asset_id, family)[0]


def _list_symmetries(asset_id: AssetId, family: AnyFamily) -> tuple[Symmetry, ...]:
    if not isinstance(family, Family) or family.symmetries is None:
        return ()
    return _call(family.symmetries, asset_id, family)[0]


def _make(asset_id: AssetId, family: AnyFamily) -> Any:
    activity.tell(f"making {asset_id}")
    return _make_and_list(asset_id, family)[0]


def _make_and_list(asset_id: AssetId, family: AnyFamily) -> tuple[Any, dict[str, Draw]]:
    """An asset, and its named draws.

    Raises:
        AssetError: the id has a parameter that the variant neither takes nor draws.
        ValueError: it has an impossible value.
    """
    made, drawn = _call(family.build, asset_id, family)
    arguments, asked = _merge_arguments(asset_id, family)
    for key in asked:
        if key not in drawn:
            raise _unknown_parameter(asset_id, key, {*arguments, *drawn})
    return made, drawn


def _call(
    function: Callable[..., T], asset_id: AssetId, family: AnyFamily
) -> tuple[T, dict[str, Draw]]:
    arguments, asked = _merge_arguments(asset_id, family)
    with drawing(asked) as drawn:
        return function(**arguments), drawn


def _unknown_parameter(asset_id: AssetId, key: str, known: Collection[str]) -> AssetError:
    return AssetError(
        f"asset '{asset_id}': '{asset_id.name}' has no parameter '{key}'"
        f"{did_you_mean(key, known)}; expected {', '.join(sorted(known)) or 'none'}"
    )


def _list_tags(name: str, family: AnyFamily) -> tuple[str, ...]:
    """Sorted tags of a family: its own, its name, and its category as one word."""
    category = family.category if isinstance(family, Family) else family.name
    words = {*family.tags, name.rpartition("/")[2], category.replace(" ", "_"), "procedural"}
    return tuple(sorted(words))


def _merge_arguments(
    asset_id: AssetId, family: AnyFamily
) -> tuple[dict[str, Any], dict[str, ParameterValue]]:
    """Every parameter of a family's function, from the id or by default; values of draws.

    Raises:
        AssetError: if the id has a parameter of the wrong type, or an unknown one and no seed.
    """
    arguments: dict[str, Any] = dict(family.parameters)
    asked: dict[str, ParameterValue] = {}
    if family.variants or not isinstance(family, Family):
        arguments.setdefault("seed", 0)
    for key, value in asset_id.parameters.items():
        if key in arguments:
            arguments[key] = _check_type(asset_id, key, value, arguments[key])
        elif "seed" in arguments:
            asked[key] = value
        else:
            raise _unknown_parameter(asset_id, key, arguments)
    return arguments, asked


def _check_type(asset_id: AssetId, key: str, value: ParameterValue, default: Any) -> ParameterValue:
    """Check that a value has the default's type; convert integers to float where needed.

    A default without numbers stands for any number of them.
    """
    if key == "seed" and not (isinstance(value, int) and 0 <= value <= _MAX_SEED):
        raise AssetError(f"asset '{asset_id}': seed is not an integer from 0 to {_MAX_SEED}")
    if isinstance(default, tuple):
        if isinstance(value, tuple) and (not default or len(value) == len(default)):
            return value
        raise AssetError(
            f"asset '{asset_id}': {key} expects {len(default)} comma-separated numbers"
        )
    if isinstance(default, str) != isinstance(value, str) or isinstance(value, tuple):
        expected = "a word" if isinstance(default, str) else "a number"
        raise AssetError(f"asset '{asset_id}': {key} expects {expected}")
    return float(value) if isinstance(default, float) and isinstance(value, int) else value


_MAKE: Mapping[str, Callable[[ProceduralLibrary, AssetId], object]] = {
    "object": ProceduralLibrary.imported,
    "texture": ProceduralLibrary.texture,
    "environment": ProceduralLibrary.environment,
}
