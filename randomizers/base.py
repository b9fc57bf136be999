"""What all randomizers share."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Literal

from pydantic import Field

from gen_data.generator.config.base_model import Strict
from gen_data.generator.core.asset_types import Asset, Material
from gen_data.generator.core.bounded_cache import ObjectCache
from gen_data.generator.core.errors import ConfigError, did_you_mean
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Body, Scene
from gen_data.generator.core.streams import Rng

_BY_WORD: ObjectCache[Mapping[str, tuple[str, ...]]] = ObjectCache(2)


class RandomizerBase(Strict):
    """Frozen parameters and one pure method.

    Attributes:
        name: The key of its random stream: two of one type need two names.
        stage: scene: drawn once, all views share it. view: drawn anew for every view.
    """

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")
    stage: Literal["scene", "view"] = "scene"

    @property
    def motion_duration_s(self) -> float | None:
        """How long the motion that it draws lasts, from time 0 [s]; None if it draws none."""
        return None

    def possible_assets(self, assets: AssetIndex) -> tuple[str, ...]:
        """Ids of the assets that only it may bring into a scene; they are part of the plan."""
        del assets
        return ()

    def check(self, scene: Scene, assets: AssetIndex) -> None:
        """Compare the names in its fields with a nominal scene and the library, before a run.

        Raises:
            ConfigError: a name stands for nothing; the text begins with
                ``randomizers.<name>.<field>: ``.
        """

    @abstractmethod
    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """A new scene; the given one stays as it is."""


class LookRandomizer(RandomizerBase):
    """A randomizer of surfaces: it looks at every material of its targets.

    Attributes:
        targets: Names of object groups or bodies; empty = every object group.
    """

    targets: tuple[str, ...] = ()

    def chosen(self, scene: Scene) -> Iterator[Body]:
        """The bodies it looks at, in order.

        Raises:
            ConfigError: a target names nothing.
        """
        groups = {group.name for group in scene.groups}
        owners = {body.name.partition("/")[0] for body in scene.bodies}
        for target in self.targets:
            if target not in groups | owners:
                known = sorted(groups | owners)
                raise ConfigError(
                    f"randomizers.{self.name}.targets: there is no '{target}'; expected one of "
                    f"{', '.join(known)}{did_you_mean(target, known)}"
                )
        wanted = set(self.targets) or groups
        for body in scene.bodies:
            if body.group in wanted or body.name.partition("/")[0] in wanted:
                yield body


def body_materials(body: Body, assets: AssetIndex) -> tuple[Material, ...]:
    """The materials a body shows: its own, else its asset's."""
    return body.materials or assets.materials(body.asset)


def set_materials(body: Body, assets: AssetIndex, change: Callable[[Material], Material]) -> Body:
    """The body with every material changed that is not printed."""
    changed = tuple(
        material if material.printed else change(material)
        for material in body_materials(body, assets)
    )
    return replace(body, materials=changed)


def find_textures(assets: AssetIndex, names: tuple[str, ...], field: str) -> tuple[str, ...]:
    """Ids of all textures that carry any of these tags, or are of these families; sorted.

    Raises:
        ConfigError: there is none for a name.
    """
    textures = assets.find((), kind="texture")
    by_word = _BY_WORD.get(textures, lambda: _by_word(textures))
    for name in names:
        if name not in by_word:
            known = sorted(by_word)
            raise ConfigError(
                f"{field}: there is no texture '{name}'; expected one of {', '.join(known)}"
                f"{did_you_mean(name, known)}"
            )
    return tuple(sorted({texture for name in names for texture in by_word[name]}))


def _by_word(textures: tuple[Asset, ...]) -> Mapping[str, tuple[str, ...]]:
    """Ids of textures by tag and by family."""
    by_word: dict[str, list[str]] = {}
    for texture in textures:
        for word in {_family(texture.asset_id), *texture.tags}:
            by_word.setdefault(word, []).append(texture.asset_id)
    return {word: tuple(ids) for word, ids in by_word.items()}


def choose(options: tuple[str, ...], rng: Rng) -> str:
    """One of several, each as likely as the others."""
    return options[int(rng.integers(len(options)))]


def _family(asset_id: str) -> str:
    return asset_id.partition("/")[2].partition("?")[0]
