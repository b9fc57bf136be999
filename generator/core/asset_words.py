"""Words by which configurations leave assets out."""

from collections.abc import Collection, Iterable

from gen_data.core.asset_types import Asset
from gen_data.core.errors import ConfigError, one_of
from gen_data.core.interfaces import AssetIndex


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
