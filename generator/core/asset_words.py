"""Words by which configurations choose assets and leave them out."""

from collections.abc import Collection, Iterable

from gen_data.core.asset_types import Asset
from gen_data.core.errors import ConfigError, one_of
from gen_data.core.interfaces import AssetIndex

SOURCES = frozenset({"pack", "user"})
"""Tags of assets of installed packs and of the user's folders, of which there may be none."""


def check_tags(tags: Collection[str], assets: AssetIndex, field: str) -> None:
    """Refuse tags that no object of the library has. Raises ConfigError, see ``check_words``."""
    for tag in tags:
        if tag not in SOURCES and not assets.find((tag,)):
            known = SOURCES.union(*(asset.tags for asset in assets.find(())))
            raise ConfigError(
                f"{field}: no object has the tag '{tag}'; {one_of(tag, sorted(known))}"
            )


def check_categories(categories: Collection[str], assets: AssetIndex, field: str) -> None:
    """Refuse categories that no object has. Raises ConfigError, see ``check_words``."""
    known = {asset.category for asset in assets.find(())} if categories else set()
    for name in categories:
        if name not in known:
            fact = f"no object has the category '{name}'; {one_of(name, sorted(known))}"
            raise ConfigError(f"{field}: {fact}")


def check_words(
    words: Collection[str], found: Iterable[Asset], assets: AssetIndex, field: str
) -> None:
    """Refuse words that no object of the library has.

    Args:
        words: Tags, categories or subcategories.
        found: Objects that are looked at first: to describe all objects takes a second.
        assets: The library.
        field: The field with the words, which begins the message.

    Raises:
        ConfigError: names the first unknown word, and the nearest known ones.
    """
    objects = tuple(found)
    left = {word for word in words if not any(asset.has_word(word) for asset in objects)}
    known = frozenset[str]().union(*(asset.words for asset in assets.find(()))) if left else ()
    for word in words:
        if word in left and word not in known:
            raise ConfigError(f"{field}: no object has '{word}'; {one_of(word, sorted(known))}")
