"""Merging of documents.

1. Mappings merge key by key; numbers, texts and lists are replaced as a whole.
2. A distribution and a selection by a shared value are one value each: they are replaced.
3. A mapping with another ``type`` (``model`` if it has no type) replaces the old one as a whole.
4. Keys that select assets (``asset``, ``ids``, ``tags``, ``any_of``) are alternatives: giving one
   drops the inherited ones. So are the ways to give a camera's distance, its focal length and
   its place on a rig.
5. Elements, randomizers and sensors merge item by item, see ``merge_named``.
"""

from collections.abc import Mapping
from dataclasses import replace

from gen_data.config.shared_values import is_reference
from gen_data.config.yaml_tree import Node, is_distribution

ASSET_KEYS = frozenset({"asset", "ids", "tags", "any_of"})
"""Alternatives: a mapping that gives one of these keys inherits none of them."""

PLACE_KEYS = ("offset_m", "yaw_deg", "pitch_deg", "roll_deg")
"""Place of a sensor on its rig, which a file may give (``mounting``)."""

DROPPED: Mapping[str, frozenset[str]] = {
    **dict.fromkeys(ASSET_KEYS, ASSET_KEYS),
    "fills": frozenset({"distance_m", "jitter_m"}),
    "distance_m": frozenset({"fills", "off_center"}),
    "intrinsics": frozenset({"hfov_deg"}),
    "hfov_deg": frozenset({"intrinsics"}),
    "mounting": frozenset(PLACE_KEYS),
    **dict.fromkeys(PLACE_KEYS, frozenset({"mounting"})),
}
"""Inherited keys that a mapping drops, by the key that it gives."""


def merge_nodes(base: Node, override: Node) -> Node:
    """Merge ``override`` into ``base``."""
    if not isinstance(base.content, Mapping) or not isinstance(override.content, Mapping):
        return override
    is_one_value = any(is_distribution(node) or is_reference(node) for node in (base, override))
    if is_one_value or _differ_in_kind(base, override):
        return override
    dropped = {old for key in override.content for old in DROPPED.get(key, ())}
    if (model := override.get("lens", "model")) is not None and model.content == "calibrated":
        dropped |= {"hfov_deg", "intrinsics"}
    content = {key: node for key, node in base.content.items() if key not in dropped}
    for key, node in override.content.items():
        content[key] = merge_nodes(content[key], node) if key in content else node
    positions = {**base.key_positions, **override.key_positions}
    return Node(override.position, content, positions)


def merge_named(base: Node, override: Node) -> Node:
    """Merge a list of plug-ins into another.

    An item merges with the inherited one of the same name. New items come last, or right before
    the inherited item that follows them in ``override``.
    """
    if not isinstance(base.content, tuple) or not isinstance(override.content, tuple):
        return override
    items = {node_name(item): item for item in base.content}
    order = list(items)
    new: list[str] = []
    for item in override.content:
        name = node_name(item)
        if name in order:
            # An item without a name keeps the inherited one's, which it may replace.
            named = item if item.get("name") else with_entry(item, "name", items[name].get("name"))
            items[name] = merge_nodes(items[name], named)
            at = order.index(name)
            order[at:at], new = new, []
        else:
            # A new item that is listed twice is kept twice, and refused later.
            key = name if name not in items else str(item.position)
            items[key] = item
            new.append(key)
    return Node(override.position, tuple(items[name] for name in (*order, *new)))


def node_name(item: Node) -> str:
    """Key of an item in a list of plug-ins: its name, else its type, else its position."""
    for node in (item.get("name"), item.get("type"), item):
        if node is not None and isinstance(node.content, str):
            return node.content
    return str(item.position)


def with_entry(node: Node, key: str, value: Node | None) -> Node:
    """Prepend an entry to a mapping; anything else is returned unchanged."""
    if value is None or not isinstance(node.content, Mapping):
        return node
    return replace(node, content={key: value, **node.content})


def _differ_in_kind(base: Node, override: Node) -> bool:
    key = "type" if base.get("type") or override.get("type") else "model"
    old, new = base.get(key), override.get(key)
    return bool(old and new and isinstance(new.content, str) and old.content != new.content)
