"""Base classes of randomizers, and helpers for materials and textures."""

from abc import abstractmethod
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any, Literal

from pydantic import Field

from gen_data.config.base_model import NAME_PATTERN, Strict
from gen_data.core import asset_types, bounded_cache, se3, streams
from gen_data.core.asset_words import check_words
from gen_data.core.errors import ConfigError, LayoutRejected, Rejection, one_of
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Body, Scene

_BY_WORD: bounded_cache.ObjectCache[Mapping[str, tuple[str, ...]]] = bounded_cache.ObjectCache(2)


class RandomizerBase(Strict):
    """Frozen parameters and one pure method.

    Attributes:
        name: Key of the random stream; unique within a configuration.
        stage: scene: drawn once and shared by all views. view: drawn for every view.
    """

    name: str = Field(pattern=NAME_PATTERN)
    stage: Literal["scene", "view"] = "scene"

    @property
    def motion_duration_s(self) -> float | None:
        """Duration of the motion it draws, from time 0 [s]; None if it draws no motion."""
        return None

    def possible_assets(self, assets: AssetIndex) -> tuple[str, ...]:
        """Ids of the assets that only this randomizer can add to a scene; part of the plan.

        By default the files among ``possible_textures``.

        Raises:
            ConfigError: a field names an asset that is unknown.
        """
        return find_texture_files(assets, self.possible_textures(assets))

    def possible_textures(self, assets: AssetIndex) -> tuple[str, ...]:
        """Ids of the textures that it may lay on surfaces, sorted: files and generated ones.

        Raises:
            ConfigError: a field names a texture that is unknown.
        """
        del assets
        return ()

    def reject(self, reason: str, remedy: str) -> LayoutRejected:
        """Rejection of a drawn layout; the text of the remedy ends with the randomizer's name."""
        return LayoutRejected(Rejection(reason, f"{remedy} (randomizers.{self.name})"))

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """Check the names in its fields against a nominal scene and the library, before a run.

        By default the names of assets are checked.

        Raises:
            ConfigError: a name is unknown; the text begins with ``randomizers.<name>.<field>: ``.
        """
        del scene
        self.possible_assets(assets)

    @abstractmethod
    def __call__(self, scene: Scene, assets: AssetIndex, rng: streams.Rng) -> Scene:
        """Return a new scene; the one passed in is unchanged.

        Raises:
            ConfigError: a field names something unknown, or the scene lacks a required part.
            LayoutRejected: no free or possible place was found; another draw may succeed.
        """


class SurfaceRandomizer(RandomizerBase):
    """Base of randomizers that change the materials of target bodies.

    Attributes:
        targets: Names of object groups or bodies to change; empty = every object group.
        exclude: Tags, categories or subcategories of objects that are unchanged, such as ``food``.
    """

    targets: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()

    def find_targets(self, scene: Scene, assets: AssetIndex) -> Iterator[Body]:
        """Yield the target bodies in the scene's order.

        Raises:
            ConfigError: a target is neither a group nor a body.
        """
        groups = self._check_targets(scene)
        wanted = set(self.targets) or groups
        for body in scene.bodies:
            named = body.group in wanted or body.name.partition("/")[0] in wanted
            if named and not any(assets.get(body.asset).has_word(w) for w in self.exclude):
                yield body

    def _check_targets(self, scene: Scene) -> set[str]:
        """Refuse targets that are neither a group nor a body; return the names of all groups."""
        groups = {group.name for group in scene.groups}
        owners = {body.name.partition("/")[0] for body in scene.bodies}
        known = sorted(groups | owners)
        for target in self.targets:
            check_known(target, known, f"randomizers.{self.name}.targets: there is no")
        return groups

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """See ``RandomizerBase.check``; targets and excluded words are checked, too."""
        super().check(scene, assets)
        self._check_targets(scene)
        targets = (assets.get(body.asset) for body in scene.bodies)
        check_words(self.exclude, targets, assets, f"randomizers.{self.name}.exclude")

    def change_targets(
        self,
        scene: Scene,
        assets: AssetIndex,
        draw: Callable[[], Mapping[str, Any] | None],
        slots: tuple[int, ...] = (),
    ) -> Scene:
        """Return the scene with the materials of its targets changed, except printed ones.

        Args:
            scene: The scene.
            assets: Library of its assets.
            draw: Draws the changed fields of one target's materials; None = no change.
            slots: Indices of the materials to change; empty = all.
        """
        changed = []
        for body in self.find_targets(scene, assets):
            fields = draw()
            if fields is not None:
                changed.append(_set_materials(body, assets, fields, slots))
        return scene.with_bodies(*changed)


def check_known(name: str, known: Collection[str], fault: str) -> None:
    """Raise ConfigError with a text that begins with ``fault`` if a name is not among the known."""
    if name not in known:
        raise ConfigError(f"{fault} '{name}'; {one_of(name, known)}")


def body_materials(body: Body, assets: AssetIndex) -> tuple[asset_types.Material, ...]:
    """Materials of a body: its overrides if it has any, else its asset's."""
    return body.materials or assets.materials(body.asset)


def _set_materials(
    body: Body, assets: AssetIndex, fields: Mapping[str, Any], slots: tuple[int, ...]
) -> Body:
    changed = tuple(
        material if material.printed or (slots and k not in slots) else replace(material, **fields)
        for k, material in enumerate(body_materials(body, assets))
    )
    return replace(body, materials=changed)


def find_textures(assets: AssetIndex, names: tuple[str, ...], field: str) -> tuple[str, ...]:
    """Find all textures with any of these ids, tags or families; sorted ids.

    Raises:
        ConfigError: a name matches no texture.
    """
    textures = assets.find((), kind="texture")
    by_word = _BY_WORD.get(textures, lambda: _by_word(textures))
    known = sorted(by_word)
    for name in names:
        check_known(name, known, f"{field}: there is no texture")
    return tuple(sorted({texture for name in names for texture in by_word[name]}))


def find_texture_files(assets: AssetIndex, textures: tuple[str, ...]) -> tuple[str, ...]:
    """Ids of the textures that are files of a user or a pack.

    The release of gen-data identifies generated textures; a plan records hashes of files only.
    """
    if not textures:
        return ()
    files = {a.asset_id for a in assets.find((), kind="texture") if "procedural" not in a.tags}
    return tuple(texture for texture in textures if texture in files)


def _by_word(textures: tuple[asset_types.Asset, ...]) -> Mapping[str, tuple[str, ...]]:
    by_word: dict[str, list[str]] = {}
    for texture in textures:
        for word in {texture.asset_id, _family(texture.asset_id), *texture.tags}:
            by_word.setdefault(word, []).append(texture.asset_id)
    return {word: tuple(ids) for word, ids in by_word.items()}


def set_emission(body: Body, assets: AssetIndex, emission_cd_m2: Mapping[str, se3.Vec3]) -> Body:
    """Return the body with the emission of some roles replaced."""
    slots = body_materials(body, assets)
    return replace(
        body,
        materials=tuple(
            replace(m, emission_cd_m2=emission_cd_m2.get(m.role, m.emission_cd_m2)) for m in slots
        ),
    )


def add_attributes(scene: Scene, attributes: Mapping[int, Iterable[tuple[str, str]]]) -> Scene:
    """Return the scene with further attributes of some instances, by instance id."""
    instances = []
    for instance in scene.instances:
        if instance.instance_id in attributes:
            merged = dict(instance.attributes) | dict(attributes[instance.instance_id])
            instance = replace(instance, attributes=tuple(sorted(merged.items())))  # noqa: PLW2901
        instances.append(instance)
    return replace(scene, instances=tuple(instances))


def scale_emission(color: se3.Vec3, luminance_cd_m2: float) -> se3.Vec3:
    """Emission [cd/m^2] of a colour of luminance 1, rounded to three decimals."""
    red, green, blue = (round(part * luminance_cd_m2, 3) for part in color)
    return (red, green, blue)


def choose(options: tuple[str, ...], rng: streams.Rng) -> str:
    """Draw one option uniformly."""
    return options[int(rng.integers(len(options)))]


def _family(asset_id: str) -> str:
    return asset_id.partition("/")[2].partition("?")[0]
