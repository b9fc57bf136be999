"""Positions for errors of plug-ins, which know their name but no document."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

from gen_data.config import problems, yaml_tree
from gen_data.core.errors import ConfigError

_FIELD = re.compile(
    r"(?P<list>elements|randomizers|sensors|annotations)\.(?P<name>[\w-]+)"
    r"(\.(?P<field>[\w.]+))?: (?P<fact>.*)",
    re.DOTALL,
)
_SECTION = re.compile(r"(?P<field>render\.[\w.]+): (?P<fact>.*)", re.DOTALL)
_PLUGIN = re.compile(r"(?P<list>sensor|exporter) '(?P<name>[\w-]+)': (?P<fact>.*)", re.DOTALL)


@contextmanager
def located_errors(document: yaml_tree.Node) -> Iterator[None]:
    """Add ``file:line:column`` to a ConfigError of a plug-in of a document.

    Its message begins with ``elements.<name>.<field>:``, ``randomizers...``, ``sensors...``,
    ``annotations...``, ``sensor '<name>':``, ``exporter '<type>':`` or ``render.<field>:``; others
    stay as they are.
    """
    try:
        yield
    except ConfigError as error:
        section = _SECTION.fullmatch(str(error))
        if section is not None and type(error) is ConfigError:
            value = document.get(*section["field"].split("."))
            if value is None:
                raise
            problems.refuse(value.position, section["field"], section["fact"])
        found = _FIELD.fullmatch(str(error)) or _PLUGIN.fullmatch(str(error))
        if found is None or type(error) is not ConfigError:
            raise
        parts = found.groupdict()
        key = parts["list"] if parts["list"].endswith("s") else f"{parts['list']}s"
        number = _find_item(document, key, parts["name"])
        if number is None:
            raise
        item, field = document.entries[key].items[number], parts.get("field") or ""
        # A field with its default has no position.
        node = item.get(*field.split(".")) if field else None
        path = f"{key}[{number}].{field}" if field else f"{key}[{number}]"
        # "elements.table.on" and "elements[2].on" are the same; "sensor 'left'" is more specific.
        fact = parts["fact"] if key == parts["list"] else str(error)
        problems.refuse((node or item).position, path, fact)


def _find_item(document: yaml_tree.Node, key: str, name: str) -> int | None:
    """Number of the first item of a list with this name, or else of this type or text."""
    items = document.entries[key].items if key in document.entries else ()
    for tag in ("name", "type"):
        for number, item in enumerate(items):
            if item.content == name:
                return number
            node = item.get(tag)
            if node is not None and node.content == name:
                return number
    return None
