"""The text of a configuration as the page shows it: faults by position, values by origin."""

import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from gen_data.config.problems import FieldPath, format_path
from gen_data.config.yaml_scalars import to_flow_yaml
from gen_data.config.yaml_tree import Node, is_distribution
from gen_data.core.errors import GenDataError

if TYPE_CHECKING:
    from gen_data.assemble.config import Config

_SOURCE_LINE = re.compile(r"\n +(?:\d+)? \|")
"""Quoted lines of the source below a message, which the editor shows anyway."""


@dataclass(frozen=True, slots=True)
class Fault:
    """An error in the text, as the command line states it.

    Attributes:
        line, column: From 1; 0 for an error without a place in this file.
        text: The whole message, with its place.
    """

    line: int
    column: int
    text: str


@dataclass(frozen=True, slots=True)
class Origin:
    """A value of the resolved configuration and the place that gives it.

    Attributes:
        field: Dotted path: ``randomizers[0].count``.
        value: As YAML.
        place: ``file:line``; the file is a name without folders, or ``--set``.
    """

    field: str
    value: str
    place: str


@dataclass(frozen=True)
class Analysis:
    """Meaning of a text: its configuration, or its faults.

    Attributes:
        config: None if there are faults.
        warnings: Texts of warnings, such as renamed keys.
    """

    config: "Config | None"
    faults: tuple[Fault, ...] = ()
    warnings: tuple[str, ...] = ()


def analyse(text: str, file: str, *, first_scene_only: bool = False) -> Analysis:
    """Load a text as the command line would load the file; every error is a fault.

    Args:
        text: Text of the editor, saved or not.
        file: Path of the file, from which relative paths start.
        first_scene_only: Leave out outcomes of shared values other than the first scene's: a street
            has more than sixty, which take ten times as long.
    """
    from gen_data.assemble.config import parse_config

    try:
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            config = parse_config(text, file, Path(file).stem, first_scene_only=first_scene_only)
    except GenDataError as error:
        return Analysis(None, tuple(find_faults(str(error), file)))
    return Analysis(config, (), tuple(str(one.message) for one in heard))


def find_faults(message: str, file: str) -> Iterator[Fault]:
    """Split the message of an error into its faults, each with its place in the file."""
    place = re.compile(rf"^{re.escape(file)}:(\d+):(\d+): ", re.MULTILINE)
    starts = [match.start() for match in place.finditer(message)]
    for start, end in zip([0, *starts], [*starts, len(message)], strict=True):
        text = message[start:end].strip("\n")
        if not text:
            continue
        found = place.match(text)
        line, column = map(int, found.groups()) if found else (0, 0)
        yield Fault(line, column, _SOURCE_LINE.split(text)[0])


def list_origins(config: "Config") -> Iterator[Origin]:
    """Yield every value that a file gives, in the order of the resolved configuration."""
    yield from _origins(config.document, ())


def _origins(node: Node, path: FieldPath) -> Iterator[Origin]:
    children = node.children
    if children and not is_distribution(node) and not _is_plain_list(node):
        for part, child in children.items():
            yield from _origins(child, (*path, part))
    elif node.position.file != "(default)":
        place = f"{Path(node.position.file).name}:{node.position.line}"
        yield Origin(format_path(path), to_flow_yaml(node.plain()), place)


def _is_plain_list(node: Node) -> bool:
    return bool(node.items) and not any(item.children for item in node.items)


def find_item(text: str, file: str, line: int) -> tuple[str, str] | None:
    """Section and name of the item of a list that a line of the text is in; None if there is none.

    Args:
        text: Text of the editor.
        file: Its name in messages.
        line: From 1.
    """
    from gen_data.config.merging import node_name
    from gen_data.config.yaml_tree import parse_yaml

    try:
        document = parse_yaml(text, file)
    except GenDataError:
        return None
    found: tuple[int, tuple[str, str]] | None = None
    for section, node in document.entries.items():
        begin = document.key_position(section).line
        named = [(item.position.line, node_name(item)) for item in node.items if item.entries]
        named += [
            (node.key_position(key).line, key) for key in node.entries if section == "elements"
        ]
        for start, name in [(begin, ""), *named]:
            if start <= line and (found is None or start >= found[0]):
                found = start, (section, name)
    return None if found is None else found[1]
