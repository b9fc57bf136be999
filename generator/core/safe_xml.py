"""Safe parsing of untrusted XML: bounded in size, without document types or entities."""

import re
from typing import Any
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from gen_data.core.errors import AssetError

MAX_DEPTH = 64
_OTHER_VERSION = re.compile(rb"""\A((?:\xef\xbb\xbf)?<\?xml\s+version\s*=\s*["'])(?!1\.)[^"']+""")
"""Start of a document of a version that does not exist. Files of pybullet declare 0.0, which Expat
2.5 reads and Expat of Debian 13 refuses."""


class PlacedElement(Element):
    """An element with its line and column in the file, counted from 1."""

    line: int
    column: int


def format_position(element: Element) -> str:
    """``:line:column`` of an element from ``parse_xml``; empty for any other."""
    return f":{element.line}:{element.column}" if isinstance(element, PlacedElement) else ""


def parse_xml(data: bytes, place: str, root_tag: str, kind: str, max_elements: int) -> Element:
    """Parse a document and return its root element.

    ``place`` and ``kind`` name the file and its kind in error messages.

    Raises:
        AssetError: it is malformed, has another root, more elements than ``max_elements`` or too
            many levels, or declares a document type.
    """
    builder = TreeBuilder(element_factory=PlacedElement)
    parser = expat.ParserCreate()
    depth = count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > MAX_DEPTH or count > max_elements:
            raise ValueError(f"more than {MAX_DEPTH} levels or {max_elements} elements")
        element = builder.start(tag, attributes)
        assert isinstance(element, PlacedElement)
        element.line, element.column = parser.CurrentLineNumber, parser.CurrentColumnNumber + 1

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def refuse(*_: Any) -> None:
        raise ValueError("it declares a document type, which is not allowed; remove it")

    parser.CharacterDataHandler = builder.data
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    try:
        parser.Parse(_OTHER_VERSION.sub(rb"\g<1>1.0", data), True)
        root: Element = builder.close()
    except (ValueError, expat.ExpatError, AssertionError) as error:
        raise AssetError(f"{place}: malformed XML ({error}); correct it") from None
    if root.tag != root_tag:
        raise AssetError(
            f"{place}: its root element is <{root.tag[:40]}>, not <{root_tag}>; give {kind}"
        )
    return root
