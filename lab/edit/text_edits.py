"""Edits of single values in the text of a configuration; all other bytes are unchanged.

The text is never regenerated from its values: the author's comments, order, quotes and line ends
remain.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NoReturn

import yaml

from gen_data.config.merging import node_name
from gen_data.config.yaml_scalars import to_flow_yaml
from gen_data.config.yaml_tree import parse_yaml
from gen_data.core.errors import ConfigError

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

Path = Sequence[str | int]
"""Keys and indices; an item of a list may have its name instead of an index."""


def set_value(text: str, path: Path, value: Any) -> str:
    """The text with a new value of a field, which is added if absent.

    Args:
        text: A valid document.
        path: Field, such as ``("randomizers", "clutter", "count")``. A list without an item of that
            name gets one that overrides the inherited item.
        value: Plain data.

    Raises:
        ConfigError: the text is not a valid document, or has no separate place for the field.
    """
    return _Text(text).set(path, value)


def append_item(text: str, section: str, item: Any) -> str:
    """The text with another item in the list of a section, which is added if absent.

    Raises:
        ConfigError: the text is not a valid document, or the section is not a list.
    """
    return _Text(text).append(section, item)


class _Text:
    """A document as text and as nodes with their spans."""

    def __init__(self, text: str) -> None:
        self.tree = parse_yaml(text or "{}", "")  # Limits of size and depth; tags are refused.
        self.bom = "\ufeff" if text.startswith("\ufeff") else ""
        self.text = text.removeprefix("\ufeff")
        self.line_end = "\r\n" if "\r\n" in self.text else "\n"
        self.root: Any = yaml.compose(self.text, Loader=_LOADER)

    def set(self, path: Path, value: Any) -> str:
        if self.root is None:
            return self._add_section(path, value)
        node, tree = self.root, self.tree
        for depth, part in enumerate(path):
            key = self._key(tree, part)
            child = self._child(node, key)
            if self._is_nothing(node):
                return self._fill(node, _mapping(path[depth:], value))
            if child is None:
                if isinstance(node, yaml.MappingNode):
                    if node is self.root:
                        return self._add_section(path[depth:], value)
                    return self._insert(
                        node, f"{_plain(part)}: {_nested(path[depth + 1 :], value)}"
                    )
                if isinstance(node, yaml.SequenceNode) and isinstance(part, str):
                    item = {"name": part, **_mapping(path[depth + 1 :], value)}
                    return self._insert(node, to_flow_yaml(item))
                _refuse(path)
            if self._is_shared(node, child):
                _refuse(path)
            node, tree = child, tree.get(key) or tree
        if self._is_nothing(node):
            return self._fill(node, value)
        return self._replace(node.start_mark.index, self._end(node), to_flow_yaml(value))

    def append(self, section: str, item: Any) -> str:
        node = None if self.root is None else self._child(self.root, section)
        if node is None:
            return self._add_section((section,), [item])
        if self._is_nothing(node):
            return self.set((section,), [item])
        if not isinstance(node, yaml.SequenceNode):
            _refuse((section,))
        return self._insert(node, to_flow_yaml(item))

    @staticmethod
    def _key(tree: Any, part: str | int) -> str | int:
        """Index of the list item with a given name; any other part unchanged."""
        if isinstance(part, int) or not tree.items:
            return part
        names = [node_name(item) for item in tree.items]
        return names.index(part) if part in names else part

    @staticmethod
    def _child(node: Any, key: str | int) -> Any:
        if isinstance(node, yaml.MappingNode):
            return next((value for name, value in node.value if name.value == key), None)
        if isinstance(node, yaml.SequenceNode) and isinstance(key, int) and key < len(node.value):
            return node.value[key]
        return None

    def _is_shared(self, node: Any, child: Any) -> bool:
        """Whether a value is an alias, or has an anchor, which an alias may name."""
        start = child.start_mark.index
        if isinstance(node, yaml.MappingNode):
            least = next(key.end_mark.index for key, value in node.value if value is child)
        else:
            place = next(k for k, value in enumerate(node.value) if value is child)
            before = node.value[place - 1] if place else None
            least = node.start_mark.index if before is None else before.start_mark.index + 1
        return bool(start < least) or self.text.startswith("&", start)

    @staticmethod
    def _is_nothing(node: Any) -> bool:
        """Whether a value was left out, as after ``key:``."""
        return bool(node.start_mark.index == node.end_mark.index)

    def _end(self, node: Any) -> int:
        """Offset behind a node; a block ends behind its last value, not where the next begins."""
        if isinstance(node, yaml.ScalarNode):
            end: int = node.end_mark.index
            if node.style in ("|", ">"):
                end = len(self.text[:end].rstrip())
            return end
        if node.flow_style or not node.value:
            return int(node.end_mark.index)
        last = node.value[-1]
        return max(map(self._end, last)) if isinstance(last, tuple) else self._end(last)

    def _fill(self, node: Any, value: Any) -> str:
        """Write the value of a key that has none."""
        at = node.start_mark.index
        return self._replace(at, at, f" {to_flow_yaml(value)}")

    def _insert(self, node: Any, entry: str) -> str:
        """Add an entry behind the last one of a mapping or list."""
        end = self._end(node)
        if node.flow_style:
            inner = len(self.text[: end - 1].rstrip())
            has_comma = self.text[inner - 1] == ","
            joint = "" if not node.value else " " if has_comma else ", "
            return self._replace(inner, inner, joint + entry)
        line_end = next((k for k in range(end, len(self.text)) if self.text[k] in "\r\n"), None)
        at = len(self.text) if line_end is None else line_end
        dash = "- " if isinstance(node, yaml.SequenceNode) else ""
        added = f"{self.line_end}{' ' * node.start_mark.column}{dash}{entry}"
        return self._replace(at, at, added)

    def _add_section(self, path: Path, value: Any) -> str:
        """Add a field at the end of the document; names of items become items of a list."""
        section, *rest = path
        if self.root is not None and self.root.flow_style:
            return self._insert(self.root, f"{_plain(section)}: {_nested(rest, value)}")
        if section in ("randomizers", "sensors") and rest:
            body: Any = [{"name": rest[0], **_mapping(rest[1:], value)}]
        else:
            body = _mapping(rest, value) if rest else value
        joint = "" if not self.text or self.text[-1] in "\r\n" else self.line_end
        entries = "".join(f"{self.line_end}  {line}" for line in _block(body))
        added = f"{joint}{_plain(section)}:{entries or ' ' + to_flow_yaml(body)}{self.line_end}"
        return self.bom + self.text + added

    def _replace(self, start: int, end: int, new: str) -> str:
        return f"{self.bom}{self.text[:start]}{new}{self.text[end:]}"


def _block(body: Any) -> Iterator[str]:
    """Lines of a list or mapping in block style, each entry on one line; none for a scalar."""
    if isinstance(body, list):
        yield from (f"- {to_flow_yaml(item)}" for item in body)
    elif isinstance(body, dict):
        yield from (f"{_plain(key)}: {to_flow_yaml(item)}" for key, item in body.items())


def _mapping(path: Path, value: Any) -> dict[str, Any]:
    """``{a: {b: value}}`` for the path a, b; the value itself, a mapping, for an empty path."""
    for part in reversed(path):
        value = {str(part): value}
    return dict(value)


def _nested(path: Path, value: Any) -> str:
    return to_flow_yaml(_mapping(path, value) if path else value)


def _plain(key: str | int) -> str:
    return to_flow_yaml(str(key))


def _refuse(path: Path) -> NoReturn:
    field = ".".join(map(str, path))
    raise ConfigError(f"{field}: has no separate place in the file; edit its text instead")
