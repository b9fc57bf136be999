"""YAML 1.2 as a tree in which every key and every value knows its place.

Read from libyaml's *events*; its composer and constructors are never called: no tag is honoured,
no object is built, nesting costs no stack, and every limit is checked while reading.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NoReturn

import yaml
from yaml.events import (
    AliasEvent,
    CollectionEndEvent,
    CollectionStartEvent,
    DocumentStartEvent,
    Event,
    MappingStartEvent,
    ScalarEvent,
)

from gen_data.generator.config.distributions.base import DISTRIBUTIONS
from gen_data.generator.config.problems import FieldPath, Position, Problem, Problems, format_path
from gen_data.generator.config.yaml_scalars import (
    PlainScalar,
    abbreviate,
    quote_value,
    resolve_scalar,
)
from gen_data.generator.core.errors import ConfigError, did_you_mean

MAX_FILE_BYTES = 1024 * 1024
MAX_DEPTH = 32
MAX_NODES = 50_000
MAX_ALIASED_NODES = 1_000
MAX_STRING_BYTES = 4096

# The C parser where PyYAML was built with it, else the (slower) one in Python.
_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

_LINE_BREAK = re.compile(r"\r\n|\r|\n")
_BAD_IN_SOURCE = re.compile(
    "[\x00-\x09\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufeff\ufffe\uffff]"
)
_BAD_IN_STRING = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")


@dataclass(frozen=True, slots=True)
class Node:
    """A value in a document.

    Attributes:
        position: Where it begins.
        content: A scalar, a tuple of nodes (a list), or a dictionary of nodes (a mapping).
        key_positions: Where each key of a mapping stands.
        text: The scalar as it was written, without quotes.
    """

    position: Position
    content: PlainScalar | tuple[Node, ...] | Mapping[str, Node]
    key_positions: Mapping[str, Position] = field(default_factory=dict)
    text: str = ""

    def plain(self) -> Any:
        """Dictionaries, lists, strings, numbers, booleans and None."""
        if isinstance(self.content, tuple):
            return [node.plain() for node in self.content]
        if isinstance(self.content, Mapping):
            return {key: node.plain() for key, node in self.content.items()}
        return self.content

    def get(self, *path: str | int) -> Node | None:
        """The node at the end of a path of keys and indices, or None if there is none."""
        node = self
        for part in path:
            child = node._child(part)
            if child is None:
                return None
            node = child
        return node

    def key_position(self, key: str) -> Position:
        """Where a key of this mapping stands; where the mapping begins if it has no such key."""
        return self.key_positions.get(key, self.position)

    def _child(self, part: str | int) -> Node | None:
        if isinstance(self.content, Mapping):
            return self.content.get(part) if isinstance(part, str) else None
        if isinstance(self.content, tuple) and isinstance(part, int):
            return self.content[part] if 0 <= part < len(self.content) else None
        return None


def load_yaml(path: Path) -> Node:
    """The mapping in a YAML file.

    Raises:
        ConfigError: if it cannot be read, or is no valid document.
    """
    try:
        if path.exists() and not path.is_file():
            raise ConfigError(f"{path}: is no regular file")
        with path.open("rb") as file:
            data = file.read(MAX_FILE_BYTES + 1)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror or error}") from None
    except ValueError:
        raise ConfigError(f"{str(path)!r}: is no file name") from None
    return parse_yaml(_decoded(data, str(path)), str(path))


def parse_yaml(text: str, file: str) -> Node:
    """The mapping in a YAML text; ``file`` is what messages call it.

    Raises:
        ConfigError: if the text is no valid document; it names every fault that can be told apart.
    """
    # A byte order mark is legal at the start of a document, and means nothing in UTF-8.
    node = _Reader(text.removeprefix("\ufeff"), file).read()
    if not isinstance(node.content, Mapping):
        what = "nothing" if node.content is None else _noun(node)
        _refuse(node.position, "", f"expected a mapping of settings, got {what}")
    return node


def is_distribution(node: Node) -> bool:
    """Whether a node is a one-key mapping that names a distribution."""
    keys = list(node.content) if isinstance(node.content, Mapping) else []
    return len(keys) == 1 and keys[0] in DISTRIBUTIONS


def with_override(node: Node, path: str, value: str, origin: str = "--set") -> Node:
    """The document with one value exchanged, as by ``--set randomizers.clutter.count=5``.

    Args:
        node: The document.
        path: Keys joined by dots; list items by ``[index]``, or by the ``name`` they carry. Keys
            that a mapping does not have are added: validation will judge them.
        value: YAML, usually a scalar or a flow collection.
        origin: What messages call the source.

    Raises:
        ConfigError: if the path leads nowhere or the value is no YAML.
    """
    steps = _steps(path, value, origin)
    within = tuple(step.part for step in steps)
    replacement = _Reader(f"{path}={value}", origin, start=len(path) + 1, within=within).read()
    return _exchanged(node, steps, replacement, ())


@dataclass
class _Open:
    """A list or mapping whose end has not been read yet."""

    position: Position
    path: FieldPath
    anchor: str | None
    is_mapping: bool
    items: list[Node] = field(default_factory=list)
    entries: dict[str, Node] = field(default_factory=dict)
    key_positions: dict[str, Position] = field(default_factory=dict)
    key: str | None = None
    size: int = 1
    height: int = 1


class _Abort(Exception):
    """Reading cannot go on; the reason is among the problems."""


class _Reader:
    """Builds the tree of one text from the parser's events, with an explicit stack."""

    def __init__(self, text: str, file: str, *, start: int = 0, within: FieldPath = ()) -> None:
        """Read ``text[start:]``, which is the value of the field ``within``."""
        self._text = text[start:]
        self._start = start
        self._within = within
        self._file = file
        self._lines = _LINE_BREAK.split(text)
        self._problems = Problems()
        self._open: list[_Open] = []
        self._anchors: dict[str, tuple[Node, int, int] | None] = {}
        self._nodes = 0
        self._aliased = 0
        self._documents = 0
        self._root: Node | None = None

    def read(self) -> Node:
        try:
            self._check_text()
            for event in self._events():
                self._take(event)
        except _Abort:
            pass
        self._problems.raise_if_any()
        return self._root or Node(self._at(0, 0), None)

    def _events(self) -> Iterator[Event]:
        try:
            yield from yaml.parse(self._text, Loader=_LOADER)
        except yaml.MarkedYAMLError as error:
            what = ", ".join(part for part in (error.context, error.problem) if part)
            self._abort(self._blamed(error), f"not valid YAML: {what}")
        except yaml.YAMLError as error:
            self._abort(self._at(0, 0), f"not valid YAML: {abbreviate(str(error), 200)}")

    def _blamed(self, error: yaml.MarkedYAMLError) -> Position:
        """Where a syntax error lies: what was left open, if the parser only met the text's end."""
        last = max((i for i, line in enumerate(self._lines) if line.strip()), default=0)
        for mark in (error.problem_mark, error.context_mark):
            if mark is not None and mark.line <= last:
                return self._at(mark.line, mark.column)
        return Position(self._file, last + 1, len(self._lines[last]) + 1, self._lines[last])

    def _check_text(self) -> None:
        if len(self._text.encode("utf-8", "surrogatepass")) > MAX_FILE_BYTES:
            self._abort(self._at(0, 0), f"larger than {MAX_FILE_BYTES} bytes")
        for number, line in enumerate(self._lines):
            bad = _BAD_IN_SOURCE.search(line)
            if bad is None:
                continue
            where = Position(self._file, number + 1, bad.start() + 1, _printable(line))
            if bad[0] == "\t":
                self._abort(where, "a tab; indent and separate with spaces")
            self._abort(where, f"character U+{ord(bad[0]):04X} is not allowed")

    def _take(self, event: Event) -> None:
        if isinstance(event, DocumentStartEvent):
            self._start_document(event)
        elif isinstance(event, AliasEvent):
            self._take_alias(event)
        elif isinstance(event, (ScalarEvent, CollectionStartEvent)):
            self._check_node(event)
            if isinstance(event, ScalarEvent):
                self._take_scalar(event)
            else:
                self._start_collection(event)
        elif isinstance(event, CollectionEndEvent):
            self._end_collection()

    def _start_document(self, event: DocumentStartEvent) -> None:
        where = self._start_of(event)
        self._documents += 1
        if self._documents > 1:
            self._abort(where, "a second document begins; expected one document per file")
        if event.version not in (None, (1, 2)):
            self._abort(where, "only YAML 1.2 is read; remove the %YAML line")
        if event.tags:
            self._abort(where, "tags are not allowed; remove the %TAG line")

    def _check_node(self, event: ScalarEvent | CollectionStartEvent) -> None:
        where = self._start_of(event)
        if event.tag is not None:
            self._problem(where, f"tag {abbreviate(event.tag)} is not allowed")
        if event.anchor is not None:
            self._anchors[event.anchor] = None
        self._nodes += 1
        if self._nodes > MAX_NODES:
            self._abort(where, f"more than {MAX_NODES} values in one document")
        if len(self._open) >= MAX_DEPTH:
            self._abort(where, f"nested deeper than {MAX_DEPTH} levels")

    def _take_scalar(self, event: ScalarEvent) -> None:
        where = self._start_of(event)
        text: str = event.value
        self._check_string(where, text)
        if self._awaits_key():
            self._take_key(text, where, plain=event.implicit[0])
            return
        content: PlainScalar = text
        if event.implicit[0]:
            try:
                content = resolve_scalar(text)
            except ValueError as error:
                self._problem(where, str(error))
        self._add(Node(where, content, text=text), event.anchor, size=1, height=0)

    def _check_string(self, where: Position, text: str) -> None:
        if len(text.encode("utf-8", "surrogatepass")) > MAX_STRING_BYTES:
            self._abort(where, f"a text longer than {MAX_STRING_BYTES} bytes")
        bad = _BAD_IN_STRING.search(text)
        if bad:
            self._abort(where, f"a text with the character U+{ord(bad[0]):04X}")

    def _take_key(self, text: str, where: Position, *, plain: bool) -> None:
        parent = self._open[-1]
        if plain and text == "<<":
            self._problem(where, "merge keys (<<) are not part of YAML 1.2; repeat the values")
        elif plain and not text:
            self._problem(where, "an empty key; expected a name before ':'")
        elif text in parent.key_positions:
            first = parent.key_positions[text]
            path = format_path((*parent.path, text))
            self._problems.add(
                where, path, f"duplicate key; it is first given at line {first.line}"
            )
        else:
            parent.key_positions[text] = where
        parent.key = text

    def _start_collection(self, event: CollectionStartEvent) -> None:
        where = self._start_of(event)
        if self._awaits_key():
            self._abort(where, "a key must be plain text, got a list or a mapping")
        is_mapping = isinstance(event, MappingStartEvent)
        self._open.append(_Open(where, self._path(), event.anchor, is_mapping))

    def _end_collection(self) -> None:
        done = self._open.pop()
        content = done.entries if done.is_mapping else tuple(done.items)
        node = Node(done.position, content, done.key_positions)
        self._add(node, done.anchor, done.size, done.height)

    def _take_alias(self, event: AliasEvent) -> None:
        where = self._start_of(event)
        anchor = event.anchor or ""
        name = abbreviate(anchor)
        if self._awaits_key():
            self._abort(where, "a key must be plain text, got an alias")
        if anchor not in self._anchors:
            self._abort(where, f"alias *{name} has no anchor &{name} before it")
        target = self._anchors[anchor]
        if target is None:
            self._abort(where, f"alias *{name} stands inside what it names")
        node, size, height = target
        self._aliased += size
        if self._aliased > MAX_ALIASED_NODES:
            self._abort(where, f"aliases stand for more than {MAX_ALIASED_NODES} values")
        if len(self._open) + height > MAX_DEPTH:
            self._abort(where, f"nested deeper than {MAX_DEPTH} levels")
        self._add(node, None, size, height)

    def _add(self, node: Node, anchor: str | None, size: int, height: int) -> None:
        """Put a finished node where it belongs; size and height are those of its subtree."""
        if anchor is not None:
            self._anchors[anchor] = (node, size, height)
        if not self._open:
            self._root = node
            return
        parent = self._open[-1]
        parent.size += size
        parent.height = max(parent.height, height + 1)
        if not parent.is_mapping:
            parent.items.append(node)
        elif parent.key is not None:
            parent.entries.setdefault(parent.key, node)
            parent.key = None

    def _awaits_key(self) -> bool:
        return bool(self._open) and self._open[-1].is_mapping and self._open[-1].key is None

    def _path(self) -> FieldPath:
        if not self._open:
            return self._within
        parent = self._open[-1]
        if not parent.is_mapping:
            return (*parent.path, len(parent.items))
        return parent.path if parent.key is None else (*parent.path, parent.key)

    def _start_of(self, event: Event) -> Position:
        mark = event.start_mark
        return self._at(mark.line, mark.column) if mark is not None else self._at(0, 0)

    def _at(self, line: int, column: int) -> Position:
        if line == 0:
            column += self._start
        source = self._lines[line] if line < len(self._lines) else ""
        return Position(self._file, line + 1, column + 1, source)

    def _problem(self, where: Position, fact: str) -> None:
        self._problems.add(where, format_path(self._path()), fact)

    def _abort(self, where: Position, fact: str) -> NoReturn:
        self._problem(where, fact)
        raise _Abort


def _decoded(data: bytes, file: str) -> str:
    if len(data) > MAX_FILE_BYTES:
        _refuse(Position(file, 1, 1), "", f"larger than {MAX_FILE_BYTES} bytes")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8")
        lines = _LINE_BREAK.split(before)
        where = Position(file, len(lines), len(lines[-1]) + 1)
        _refuse(where, "", f"not UTF-8: byte 0x{data[error.start]:02x}; save the file as UTF-8")


def _refuse(where: Position, path: str, fact: str) -> NoReturn:
    raise ConfigError(str(Problem(where, path, fact)))


def _printable(line: str) -> str:
    return _BAD_IN_SOURCE.sub(lambda bad: " " if bad[0] == "\t" else "\ufffd", line)


def _noun(node: Node) -> str:
    if isinstance(node.content, tuple):
        return "a list"
    return "a mapping" if isinstance(node.content, Mapping) else quote_value(node.content)


@dataclass(frozen=True, slots=True)
class _Step:
    """One part of an override's path, and where it stands."""

    part: str | int
    position: Position


_STEP = re.compile(r"\[(\d{1,6})\]|\.?([^.\[\]]+)")


def _steps(path: str, value: str, origin: str) -> list[_Step]:
    source = _printable(_LINE_BREAK.split(f"{path}={value}")[0])
    steps: list[_Step] = []
    at = 0
    while at < len(path):
        match = _STEP.match(path, at)
        if match is None or (match[0].startswith(".") and at == 0):
            _refuse(
                Position(origin, 1, at + 1, source),
                "",
                f"'{abbreviate(path)}' is no path; expected something like a.b[0].c",
            )
        name_at = match.start(2) if match[2] else at
        part: str | int = match[2] if match[2] else int(match[1])
        steps.append(_Step(part, Position(origin, 1, name_at + 1, source)))
        at = match.end()
    if not 0 < len(steps) <= MAX_DEPTH:
        what = "an empty path" if not steps else f"a path of more than {MAX_DEPTH} parts"
        _refuse(Position(origin, 1, 1, source), "", what)
    return steps


def _exchanged(node: Node, steps: list[_Step], value: Node, path: FieldPath) -> Node:
    if not steps:
        return value
    step, rest = steps[0], steps[1:]
    if isinstance(node.content, tuple):
        index = _index(node, step, path)
        items = list(node.content)
        items[index] = _exchanged(items[index], rest, value, (*path, index))
        return replace(node, content=tuple(items))
    if isinstance(node.content, Mapping) or node.content is None:
        key = str(step.part)
        content = dict(node.content or {})
        child = content.get(key, Node(step.position, None))
        content[key] = _exchanged(child, rest, value, (*path, key))
        positions = {**node.key_positions}
        if key not in positions or not rest:
            positions[key] = step.position
        return replace(node, content=content, key_positions=positions, text="")
    _refuse(
        step.position,
        format_path(path),
        f"is {quote_value(node.content)}, so it has no '{abbreviate(str(step.part))}'",
    )


def _index(node: Node, step: _Step, path: FieldPath) -> int:
    """Which item of a list a step means: by number, or by the item's ``name``."""
    items = node.content if isinstance(node.content, tuple) else ()
    if isinstance(step.part, int) or step.part.isdecimal():
        index = int(step.part)
        if index < len(items):
            return index
        _refuse(step.position, format_path(path), f"has {len(items)} items, no [{index}]")
    names: dict[str, int] = {}
    for i, item in enumerate(items):
        name = item.get("name")
        if name is not None:
            names.setdefault(name.text, i)
    wrong = step.part
    if wrong not in names:
        expected = ", ".join(names) if names else "an index such as [0]"
        _refuse(
            step.position,
            format_path(path),
            f"no item is named '{abbreviate(wrong)}'; expected {expected}"
            f"{did_you_mean(wrong, names)}",
        )
    return names[wrong]
