"""YAML 1.2 documents as trees in which every key and every value has its position.

The reader uses libyaml's *events*, never its composer or constructors: tags build no objects, and
each limit is checked before the memory or stack is used.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from hashlib import blake2b
from operator import is_
from pathlib import Path
from typing import Any, NoReturn

import yaml
from yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    NodeEvent,
    ScalarEvent,
    SequenceEndEvent,
)

from gen_data.config.distributions.base import DISTRIBUTIONS
from gen_data.config.problems import FieldPath, Position, Problems, format_path, refuse
from gen_data.config.yaml_scalars import PlainScalar, abbreviate, quote_value, resolve_scalar
from gen_data.core.bounded_cache import CountCache
from gen_data.core.errors import ConfigError, did_you_mean

MAX_FILE_BYTES = 1024 * 1024
MAX_DEPTH = 32
MAX_NODES = 50_000
MAX_ALIASED_NODES = 1_000
MAX_STRING_BYTES = 4096

_TOO_DEEP = f"nested deeper than {MAX_DEPTH} levels"
_LIBYAML_TOO_DEEP = "exceeded maximum nesting depth"
"""libyaml's message, from version 0.2.6 on, for 1,000 open brackets, before it returns the
first."""

_PLAIN = (
    (
        r"block collection, .*(expected '-' indicator|<block end>)",
        "text behind the end of an item; a field belongs before the last '}', and another item "
        "begins on a new line with '- '",
    ),
    (
        r"block mapping, .*(expected key|<block end>)",
        "text behind the end of a value, or a line without 'key: value'; a field belongs before "
        "the last '}' or ']', or on a line with the indentation of its neighbours",
    ),
    (
        r"flow sequence, .*expected ',' or '\]'",
        "the list that began with '[' goes on; expected ',' and another value, or ']'",
    ),
    (
        r"flow mapping, .*expected ',' or '\}'",
        "the mapping that began with '{' goes on; expected ',' and another field, or '}'",
    ),
    (
        r"quoted scalar, found unexpected end of stream",
        "the text that began with a quote never ends; expected the same quote behind it",
    ),
    (
        r"mapping values are not allowed",
        "a second ':' in one value, or a deeper indentation than in the line before; quote a "
        "text that has a ':', and indent neighbours alike",
    ),
    (
        r"cannot start any token",
        "a value cannot begin with this character; expected quotes around the text",
    ),
)
"""Messages of libyaml and of PyYAML's parser, and their meaning without the grammar of YAML."""

ORIGIN = "--set"
"""Name of overrides in messages, in place of a file."""

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
        position: Position of its first character.
        content: A scalar, a tuple of nodes (a list), or a dictionary of nodes (a mapping).
        key_positions: Positions of a mapping's keys.
        text: The scalar as written, without quotes.
        replaced: Inherited declarations that a shared value replaces.
    """

    position: Position
    content: PlainScalar | tuple[Node, ...] | Mapping[str, Node]
    key_positions: Mapping[str, Position] = field(default_factory=dict)
    text: str = ""
    replaced: tuple[Node, ...] = field(default=(), compare=False, repr=False)

    def plain(self) -> Any:
        """Dictionaries, lists, strings, numbers, booleans and None."""
        if isinstance(self.content, tuple):
            return [node.plain() for node in self.content]
        if isinstance(self.content, Mapping):
            return {key: node.plain() for key, node in self.content.items()}
        return self.content

    @property
    def entries(self) -> Mapping[str, Node]:
        """Entries of a mapping; none for anything else."""
        return self.content if isinstance(self.content, Mapping) else {}

    @property
    def items(self) -> tuple[Node, ...]:
        """Items of a list; none for anything else."""
        return self.content if isinstance(self.content, tuple) else ()

    @property
    def children(self) -> Mapping[str | int, Node]:
        """Values of a list or mapping by index or key; none for a scalar."""
        return dict(enumerate(self.items)) | dict(self.entries)

    def with_children(self, change: Callable[[str | int, Node], Node]) -> Node:
        """The same list or mapping with changed values; this node if none has changed."""
        content: tuple[Node, ...] | Mapping[str, Node]
        if isinstance(self.content, tuple):
            content = tuple([change(k, n) for k, n in enumerate(self.content)])
        elif isinstance(self.content, Mapping):
            content = {k: change(k, n) for k, n in self.content.items()}
        else:
            return self
        old = self.content.values() if isinstance(self.content, Mapping) else self.content
        new = content.values() if isinstance(content, Mapping) else content
        return self if all(map(is_, old, new)) else replace(self, content=content)

    def get(self, *path: str | int) -> Node | None:
        """The node at the end of a path of keys and indices, or None if there is none."""
        node: Node | None = self
        for part in path:
            node = node.children.get(part) if node else None
        return node

    def key_position(self, key: str) -> Position:
        """Position of a key of this mapping; of the mapping itself if it has no such key."""
        return self.key_positions.get(key, self.position)


def load_yaml(path: Path) -> Node:
    """Read the mapping in a YAML file.

    Raises:
        ConfigError: the file cannot be read, or is not a valid document.
    """
    try:
        if path.exists() and not path.is_file():
            raise ConfigError(f"{path}: is not a regular file")
        with path.open("rb") as file:
            data = file.read(MAX_FILE_BYTES + 1)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror or error}") from None
    except ValueError:
        raise ConfigError(f"{str(path)!r}: is not a file name") from None
    # Pages and tests read the same templates again and again.
    name = f"{path}:{blake2b(data).hexdigest()}"
    return _LOADED.get(name, lambda: parse_yaml(_decode(data, str(path)), str(path)))


_LOADED: CountCache[Node] = CountCache(16)
"""Trees of the latest files, by path and content."""


def parse_yaml(text: str, file: str, max_nodes: int = MAX_NODES) -> Node:
    """Parse the mapping in a YAML text; ``file`` is its name in messages.

    Raises:
        ConfigError: the text is not a valid document; the message lists all independent errors.
    """
    # A byte order mark is legal at the start of a document, and has no meaning in UTF-8.
    node = _Reader(text.removeprefix("\ufeff"), file, max_nodes=max_nodes).read()
    if not isinstance(node.content, Mapping):
        what = "a list" if isinstance(node.content, tuple) else quote_value(node.content)
        refuse(node.position, "", f"expected a mapping of settings, got {what}")
    return node


def is_distribution(node: Node) -> bool:
    """Whether a node is a one-key mapping that names a distribution."""
    return len(node.entries) == 1 and next(iter(node.entries)) in DISTRIBUTIONS


def find_text(node: Node, text: str, path: FieldPath = ()) -> tuple[Position, str] | None:
    """Position and field of the first scalar with a text; None if there is none."""
    if text in (node.text, node.content):
        return node.position, format_path(path)
    found = (find_text(child, text, (*path, part)) for part, child in node.children.items())
    return next((place for place in found if place), None)


def with_override(node: Node, path: str, value: str) -> Node:
    """Replace one value of a document, as ``--set randomizers.clutter.count=5`` does.

    Args:
        node: The document.
        path: Keys joined by dots; list items by ``[index]`` or by their ``name``. Missing
            keys of mappings are added and left to validation.
        value: YAML, usually a scalar or a flow collection.

    Raises:
        ConfigError: the path does not exist, or the value is not valid YAML.
    """
    steps = _parse_path(path, value)
    within = tuple(part for part, _ in steps)
    replacement = _Reader(f"{path}={value}", ORIGIN, start=len(path) + 1, within=within).read()
    return _replace_value(node, steps, replacement, ())


class _Abort(Exception):
    """Reading cannot continue; the reason is among the problems."""


class _Reader:
    """Builds the tree of one text from the parser's events.

    It descends recursively, which is safe because the depth is limited before each descent.
    """

    def __init__(
        self,
        text: str,
        file: str,
        *,
        start: int = 0,
        within: FieldPath = (),
        max_nodes: int = MAX_NODES,
    ) -> None:
        """Read ``text[start:]``, which is the value of the field ``within``."""
        self._max_nodes = max_nodes
        self._text = text[start:]
        self._start = start
        self._path = list(within)
        self._file = file
        self._lines = _LINE_BREAK.split(text)
        self._problems = Problems()
        self._anchors: dict[str, Node | None] = {}
        self._nodes = 0
        self._aliased = 0

    def read(self) -> Node:
        root: Node | None = None
        documents = 0
        try:
            self._check_text()
            events = self._events()
            for event in events:
                if isinstance(event, DocumentStartEvent):
                    documents += 1
                    self._check_document(event, documents)
                elif isinstance(event, NodeEvent):
                    root = self._node(event, events, depth=0)
        except _Abort:
            pass
        self._problems.raise_if_any()
        return root or Node(self._at(0, 0), None)

    def _events(self) -> Iterator[Any]:
        try:
            yield from yaml.parse(self._text, Loader=_LOADER)
        except yaml.MarkedYAMLError as error:
            what = ", ".join(part for part in (error.context, error.problem) if part)
            if _LIBYAML_TOO_DEEP in what:
                self._abort(self._place_of(error), _TOO_DEEP)
            plain = next((words for known, words in _PLAIN if re.search(known, what)), what)
            self._abort(self._place_of(error), f"not valid YAML: {plain}")
        except yaml.YAMLError as error:
            self._abort(self._at(0, 0), f"not valid YAML: {abbreviate(str(error), 200)}")

    def _place_of(self, error: yaml.MarkedYAMLError) -> Position:
        """Position of a syntax error; of the open collection if the text ended too early."""
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

    def _check_document(self, event: DocumentStartEvent, number: int) -> None:
        where = self._start_of(event)
        if number > 1:
            self._abort(where, "a second document begins; expected one document per file")
        if event.version not in (None, (1, 2)):
            self._abort(where, "only YAML 1.2 is read; remove the %YAML line")
        if event.tags:
            self._abort(where, "tags are not allowed; remove the %TAG line")

    def _node(self, event: NodeEvent, events: Iterator[Any], depth: int) -> Node:
        """The value that begins with an event; takes the rest of it from ``events``."""
        where = self._start_of(event)
        if isinstance(event, AliasEvent):
            return self._alias_target(event, depth)
        self._check_node(event, where, depth)
        if isinstance(event, ScalarEvent):
            node = self._scalar(event, where)
        elif isinstance(event, MappingStartEvent):
            node = self._mapping(events, where, depth + 1)
        else:
            node = self._list(events, where, depth + 1)
        if event.anchor is not None:
            self._anchors[event.anchor] = node
        return node

    def _check_node(self, event: Any, where: Position, depth: int) -> None:
        if event.tag is not None:
            self._problem(where, f"tag {abbreviate(event.tag)} is not allowed")
        if event.anchor is not None:
            self._anchors[event.anchor] = None
        self._nodes += 1
        if self._nodes > self._max_nodes:
            self._abort(where, f"more than {self._max_nodes} values in one document")
        if depth >= MAX_DEPTH:
            self._abort(where, _TOO_DEEP)

    def _scalar(self, event: ScalarEvent, where: Position) -> Node:
        text = self._text_of(event, where)
        content: PlainScalar = text
        if event.implicit[0]:
            try:
                content = resolve_scalar(text)
            except ValueError as error:
                self._problem(where, str(error))
        return Node(where, content, text=text)

    def _text_of(self, event: ScalarEvent, where: Position) -> str:
        text: str = event.value
        if len(text.encode("utf-8", "surrogatepass")) > MAX_STRING_BYTES:
            self._abort(where, f"a text longer than {MAX_STRING_BYTES} bytes")
        bad = _BAD_IN_STRING.search(text)
        if bad:
            self._abort(where, f"a text with the character U+{ord(bad[0]):04X}")
        return text

    def _list(self, events: Iterator[Any], where: Position, depth: int) -> Node:
        items: list[Node] = []
        self._path.append(0)
        while not isinstance(event := next(events), SequenceEndEvent):
            items.append(self._node(event, events, depth))
            self._path[-1] = len(items)
        self._path.pop()
        return Node(where, tuple(items))

    def _mapping(self, events: Iterator[Any], where: Position, depth: int) -> Node:
        entries: dict[str, Node] = {}
        positions: dict[str, Position] = {}
        while not isinstance(event := next(events), MappingEndEvent):
            key = self._key(event, positions, depth)
            self._path.append(key)
            entries.setdefault(key, self._node(next(events), events, depth))
            self._path.pop()
        return Node(where, entries, positions)

    def _key(self, event: Any, positions: dict[str, Position], depth: int) -> str:
        where = self._start_of(event)
        if isinstance(event, AliasEvent):
            self._abort(where, "a key must be plain text, got an alias")
        self._check_node(event, where, depth)
        if not isinstance(event, ScalarEvent):
            self._abort(where, "a key must be plain text, got a list or a mapping")
        text, is_plain = self._text_of(event, where), event.implicit[0]
        if is_plain and text == "<<":
            self._problem(where, "merge keys (<<) are not part of YAML 1.2; repeat the values")
        elif is_plain and not text:
            self._problem(where, "an empty key; expected a name before ':'")
        elif text in positions:
            path = format_path((*self._path, text))
            fact = f"duplicate key; it is first given at line {positions[text].line}"
            self._problems.add(where, path, fact)
        else:
            positions[text] = where
        return text

    def _alias_target(self, event: AliasEvent, depth: int) -> Node:
        where, name = self._start_of(event), abbreviate(event.anchor or "")
        if event.anchor is None or event.anchor not in self._anchors:
            self._abort(where, f"alias *{name} has no anchor &{name} before it")
        target = self._anchors[event.anchor]
        if target is None:
            self._abort(where, f"alias *{name} is inside the node it refers to")
        # Aliases of aliases grow exponentially: their contents count, not their number.
        levels, count = _extent(target)
        self._aliased += count
        if self._aliased > MAX_ALIASED_NODES:
            self._abort(where, f"aliases stand for more than {MAX_ALIASED_NODES} values")
        if depth + levels > MAX_DEPTH:
            self._abort(where, _TOO_DEEP)
        return target

    def _start_of(self, event: Any) -> Position:
        return self._at(event.start_mark.line, event.start_mark.column)

    def _at(self, line: int, column: int) -> Position:
        if line == 0:
            column += self._start
        source = self._lines[line] if line < len(self._lines) else ""
        return Position(self._file, line + 1, column + 1, source)

    def _problem(self, where: Position, fact: str) -> None:
        self._problems.add(where, format_path(tuple(self._path)), fact)

    def _abort(self, where: Position, fact: str) -> NoReturn:
        self._problem(where, fact)
        raise _Abort


def _extent(node: Node) -> tuple[int, int]:
    """Levels of lists and mappings in a tree (0 for a scalar), and its number of values."""
    extents = [_extent(child) for child in node.children.values()]
    is_scalar = not isinstance(node.content, (tuple, Mapping))
    levels = 0 if is_scalar else 1 + max((levels for levels, _ in extents), default=0)
    return levels, 1 + sum(count for _, count in extents)


def _decode(data: bytes, file: str) -> str:
    if len(data) > MAX_FILE_BYTES:
        refuse(Position(file, 1, 1), "", f"larger than {MAX_FILE_BYTES} bytes")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8")
        lines = _LINE_BREAK.split(before)
        where = Position(file, len(lines), len(lines[-1]) + 1)
        refuse(where, "", f"not UTF-8: byte 0x{data[error.start]:02x}; save the file as UTF-8")


def _printable(line: str) -> str:
    return _BAD_IN_SOURCE.sub(lambda bad: " " if bad[0] == "\t" else "\ufffd", line)


_STEP = re.compile(r"\[(\d{1,6})\]|\.?([^.\[\]]+)")
_Step = tuple[str | int, Position]
"""One part of the path of an override, with its position."""


def _parse_path(path: str, value: str) -> list[_Step]:
    source = _printable(_LINE_BREAK.split(f"{path}={value}")[0])
    steps: list[_Step] = []
    at = 0
    while at < len(path):
        match = _STEP.match(path, at)
        if match is None or (match[0].startswith(".") and at == 0):
            refuse(
                Position(ORIGIN, 1, at + 1, source),
                "",
                f"'{abbreviate(path)}' is not a path; expected the form a.b[0].c",
            )
        name_at = match.start(2) if match[2] else at
        part: str | int = match[2] if match[2] else int(match[1])
        steps.append((part, Position(ORIGIN, 1, name_at + 1, source)))
        at = match.end()
    if not 0 < len(steps) <= MAX_DEPTH:
        what = "an empty path" if not steps else f"a path of more than {MAX_DEPTH} parts"
        refuse(Position(ORIGIN, 1, 1, source), "", what)
    return steps


def _replace_value(node: Node, steps: list[_Step], value: Node, path: FieldPath) -> Node:
    if not steps:
        return value
    (part, where), *rest = steps
    if isinstance(node.content, tuple):
        index = _find_index(node.content, steps[0], path)
        child = _replace_value(node.content[index], rest, value, (*path, index))
        return node.with_children(lambda part, item: child if part == index else item)
    if node.content is not None and not isinstance(node.content, Mapping):
        fact = f"is {quote_value(node.content)}, so it has no '{abbreviate(str(part))}'"
        refuse(where, path, fact)
    key = str(part)
    child = _replace_value(node.entries.get(key, Node(where, None)), rest, value, (*path, key))
    positions = dict(node.key_positions)
    if key not in positions or not rest:
        positions[key] = where
    content = {**node.entries, key: child}
    return replace(node, content=content, key_positions=positions, text="")


def _find_index(items: tuple[Node, ...], step: _Step, path: FieldPath) -> int:
    """Index of the list item that a step gives by number or by the item's ``name``."""
    part, where = step
    if isinstance(part, int) or part.isdecimal():
        if int(part) < len(items):
            return int(part)
        refuse(where, path, f"has {len(items)} items, no [{int(part)}]")
    names: dict[str, int] = {}
    for k, item in enumerate(items):
        if name := item.get("name"):
            names.setdefault(name.text, k)
    if part not in names:
        expected = ", ".join(names) if names else "an index such as [0]"
        fact = f"no item is named '{abbreviate(part)}'; expected {expected}"
        refuse(where, path, fact + did_you_mean(part, names))
    return names[part]
