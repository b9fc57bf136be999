"""Reading YAML: places, limits, and everything that is refused."""

import os
import time
from pathlib import Path

import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from gen_data.config.problems import Position
from gen_data.config.yaml_tree import Node, load_yaml, parse_yaml
from gen_data.core.errors import ConfigError
from tests.config.messages import told

TABLETOP = """\
# a comment
seed: 7
camera:
  fov_deg: 60   # degrees
  size: [640, 480]
randomizers:
  - {name: clutter, count: {uniform_integer: [3, 12]}}
  - name: "lamps"
"""


def message_of(text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        parse_yaml(text, "x.yaml")
    return str(caught.value)


def test_a_document_becomes_plain_data_and_paths_to_nowhere_give_none() -> None:
    """Comments vanish, quotes make strings, flow and block style mean the same."""
    assert parse_yaml(TABLETOP, "t.yaml").plain() == {
        "seed": 7,
        "camera": {"fov_deg": 60, "size": [640, 480]},
        "randomizers": [
            {"name": "clutter", "count": {"uniform_integer": [3, 12]}},
            {"name": "lamps"},
        ],
    }
    # Keys of lists, indices of mappings, and parts of scalars do not exist.
    document = parse_yaml(TABLETOP, "t.yaml")
    for path in [("x",), ("seed", "x"), ("randomizers", 2), ("randomizers", "a"), ("camera", 0)]:
        assert document.get(*path) is None
    assert document.get("randomizers", -1) is None


def test_a_document_in_which_nothing_changes_stays_the_same_object() -> None:
    """Caches know nodes by identity: one that changes is new, and so are those above it."""
    document = parse_yaml(TABLETOP, "t.yaml")
    assert document.with_children(lambda _, node: node) is document

    def change(part: str | int, node: Node) -> Node:
        return Node(node.position, 8) if part == "seed" else node

    changed = document.with_children(change)
    assert changed.plain() == {**document.plain(), "seed": 8}
    assert changed.get("randomizers") is document.get("randomizers")
    assert document.plain()["seed"] == 7


@pytest.mark.parametrize(
    ("path", "line", "column"),
    [(("seed",), 2, 7), (("camera",), 4, 3), (("camera", "fov_deg"), 4, 12),
     (("camera", "size", 1), 5, 15), (("randomizers", 0), 7, 5),
     (("randomizers", 0, "count", "uniform_integer", 1), 7, 50),
     (("randomizers", 1, "name"), 8, 11)],
)  # fmt: skip
def test_every_value_knows_its_place(path: tuple[str | int, ...], line: int, column: int) -> None:
    node = parse_yaml(TABLETOP, "t.yaml").get(*path)
    assert node is not None
    assert node.position == Position("t.yaml", line, column)


def test_every_key_knows_its_place_in_characters_and_every_scalar_its_text() -> None:
    """Needed to point at a key that nobody expected."""
    document = parse_yaml(TABLETOP, "t.yaml")
    camera = document.get("camera")
    assert camera is not None
    assert str(document.key_position("camera")) == "t.yaml:3:1"
    assert str(camera.key_position("size")) == "t.yaml:5:3"
    assert camera.key_position("absent") == camera.position
    # Umlauts and emoji are one column each.
    assert message_of("ä: {ö😀: 1, ö😀: 2}").startswith("x.yaml:1:12: ä['ö😀']: duplicate key")
    # ``010`` is ten, and still known as ``010``.
    node = parse_yaml("a: 010", "x.yaml").get("a")
    assert node is not None
    assert (node.content, node.text) == (10, "010")


def test_keys_and_timestamps_are_text_aliases_are_expanded_and_byte_order_marks_read() -> None:
    """As in JSON: weights by number are keyed by their text."""
    assert parse_yaml("{1: a, true: b, null: c}", "x.yaml").plain() == {
        "1": "a",
        "true": "b",
        "null": "c",
    }
    # An alias is the value of its anchor; the last anchor of a name counts.
    assert parse_yaml("a: &x [1, 2]\nb: *x\nc: &x 3\nd: *x\n", "x.yaml").plain() == {
        "a": [1, 2],
        "b": [1, 2],
        "c": 3,
        "d": 3,
    }
    assert parse_yaml("\ufeffa: 1", "x.yaml").plain() == {"a": 1}
    assert message_of("a: 1\r\na: 2\r\n").startswith("x.yaml:2:1: a: duplicate key")
    # The core schema has no dates, so none can be malformed.
    assert parse_yaml("a: 2020-99-99T99:99:99Z", "x.yaml").plain() == {"a": "2020-99-99T99:99:99Z"}


REFUSED: dict[str, tuple[tuple[int, int, str], ...]] = {
    "a: 1\nb:\n  c: 1\n  d: 2\n  c: 3\n": (
        (5, 3, "b.c: duplicate key; it is first given at line 3"),
    ),
    "a: .inf\na: 1\n": ((1, 4, "a: .inf is not a finite number"),
                        (2, 1, "a: duplicate key; it is first given at line 1")),
    "a: !!python/object/apply:os.system [ls]\n": (
        (1, 4, "a: tag tag:yaml.org,2002:python/object/apply:os.system is not allowed"),
    ),
    "a: 1\n---\nb: 2\n": ((2, 1, "a second document begins; expected one document per file"),),
    "? [a]\n: 1\n": ((1, 3, "a key must be plain text, got a list or a mapping"),),
    "a:\n\tb: 1\n": ((2, 1, "a tab; indent and separate with spaces"),),
    "<<: {a: 1}\n": ((1, 1, "merge keys (<<) are not part of YAML 1.2; repeat the values"),),
    "a: 1\nb: [1, 2\n": (
        (2, 4, "b[2]: not valid YAML: the list that began with '[' goes on; expected ',' and"
         " another value, or ']'"),
    ),
    "a:\n  - {b: 1}, c: 2\n": (
        (2, 11, "a[1]: not valid YAML: text behind the end of an item; a field belongs before the"
         " last '}', and another item begins on a new line with '- '"),
    ),
    "a: {b: 1}, c: 2\n": (
        (1, 10, "not valid YAML: text behind the end of a value, or a line without 'key: value';"
         " a field belongs before the last '}' or ']', or on a line with the indentation of its"
         " neighbours"),
    ),
    "a: {b: [1}\n": (
        (1, 10, "a.b[1]: not valid YAML: the list that began with '[' goes on; expected ',' and"
         " another value, or ']'"),
    ),
    "a: {b: 1]\n": (
        (1, 9, "a: not valid YAML: the mapping that began with '{' goes on; expected ',' and"
         " another field, or '}'"),
    ),
    "a: b: c\n": (
        (1, 5, "not valid YAML: a second ':' in one value, or a deeper indentation than in the"
         " line before; quote a text that has a ':', and indent neighbours alike"),
    ),
    "a: 'b\n": (
        (1, 4, "a: not valid YAML: the text that began with a quote never ends; expected the same"
         " quote behind it"),
    ),
    "a: @b\n": (
        (1, 4, "a: not valid YAML: a value cannot begin with this character; expected quotes around"
         " the text"),
    ),
    "hello": ((1, 1, "expected a mapping of settings, got 'hello'"),),
    "- 1": ((1, 1, "expected a mapping of settings, got a list"),),
}  # fmt: skip
"""Faults of texts: line, column and fact."""


@pytest.mark.parametrize("text", REFUSED)
def test_refused_documents_say_place_fact_and_remedy(text: str) -> None:
    assert message_of(text) == told("x.yaml", text, *REFUSED[text])


NASTY = {
    "deep flow": ("a: " + "[" * 100_000, "nested deeper than 32 levels"),
    "deep flow mapping": ("{a: " * 100_000, "nested deeper than 32 levels"),
    "deep block": ("\n".join(" " * i + "a:" for i in range(200)), "nested deeper than 32 levels"),
    "deep block list": ("- " * 50_000, "nested deeper than 32 levels"),
    "5000-digit int": ("a: " + "9" * 5000, "a text longer than 4096 bytes"),
    "tagged float": ("a: !!float abc", "tag tag:yaml.org,2002:float is not allowed"),
    "tagged int": ("a: !!int 0xZZ", "tag tag:yaml.org,2002:int is not allowed"),
    "tagged bool": ("a: !!bool maybe", "tag tag:yaml.org,2002:bool is not allowed"),
    "bare tag": ("a: ! 1", "tag ! is not allowed"),
    "set tag": ("a: !!set {x, y}", "tag tag:yaml.org,2002:set is not allowed"),
    "surrogate in source": ("a: \ud800", "character U+D800 is not allowed"),
    "surrogate escape": ('a: "\\ud800"', "not valid YAML"),
    "NUL": ("a: \x00", "character U+0000 is not allowed"),
    "NUL escape": ('a: "\\0"', "a text with the character U+0000"),
    "escape": ("a: \x1b[31m", "character U+001B is not allowed"),
    "next line": ("a: 1\x85b: 2", "character U+0085 is not allowed"),
    "line separator": ("a: 1\u2028b: 2", "character U+2028 is not allowed"),
    "mark in the middle": ("a: \ufeff1", "character U+FEFF is not allowed"),
    "self alias": ("a: &x [*x]", "alias *x is inside the node it refers to"),
    "self alias in mapping": ("a: &x {b: {c: *x}}", "alias *x is inside the node it refers to"),
    "unknown alias": ("a: *x", "alias *x has no anchor &x before it"),
    "alias as key": ("a: &x b\n*x : 1", "a key must be plain text, got an alias"),
    "alias bomb": (
        "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]\n"
        + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 10)),
        "aliases stand for more than 1000 values",
    ),
    "deep through aliases": (
        "a0: &a0 [1]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 40)),
        "nested deeper than 32 levels",
    ),
    "merge bomb": ("a: &a {b: 1}\nc: {<<: [*a, *a]}", "merge keys (<<) are not part of YAML 1.2"),
    "many values": ("a: [" + "1," * 60_000 + "]", "more than 50000 values in one document"),
    "long text": ("a: " + "x" * 2_000_00, "a text longer than 4096 bytes"),
    "2 MB text": ("a: " + "x" * 2_000_000, "larger than 1048576 bytes"),
    "long key": ("k" * 200_000 + ": 1", "a text longer than 4096 bytes"),
    "long quoted key": ('"' + "k" * 5000 + '": 1', "a text longer than 4096 bytes"),
    "YAML 9.9": ("%YAML 9.9\n---\na: 1", "found incompatible YAML document"),
    "YAML 1.1": ("%YAML 1.1\n---\na: 1", "only YAML 1.2 is read; remove the %YAML line"),
    "tag directive": ("%TAG !e! tag:e.org,2000:\n---\na: 1", "remove the %TAG line"),
    "empty key": ("? \n: 1", "an empty key; expected a name before ':'"),
    "missing space": ("a:1\nb: 2", "not valid YAML"),
    "colon in value": ("a: b: c", "a second ':' in one value"),
    "bad indent": ("a:\n   b: 1\n  c: 2", "not valid YAML"),
    "unclosed quote": ("a: 'x", "the text that began with a quote never ends"),
    "behind": ("a:\n  - {b: 1}, c: 2\n", "text behind the end of an item"),
    "reserved": ("a: @x", "a value cannot begin with this character"),
    "binary": ("".join(chr(i) for i in range(256)), "character U+0000 is not allowed"),
    "only a comment": ("# nothing", "expected a mapping of settings, got nothing"),
    "nothing": ("", "1:1: expected a mapping of settings, got nothing"),
    "only a marker": ("---", "expected a mapping of settings, got nothing"),
}


@pytest.mark.parametrize("case", NASTY)
def test_nasty_documents_are_refused_at_once_with_a_message(case: str) -> None:
    """No traceback, no crash, no waiting: one ConfigError with a place."""
    text, fact = NASTY[case]
    begun = time.process_time()
    message = message_of(text)
    assert fact in message
    assert message.startswith("x.yaml:")
    assert time.process_time() - begun < 5.0


@pytest.mark.parametrize("case", [
    "deep flow", "alias bomb", "self alias", "NUL", "colon in value", "unclosed quote",
    "reserved", "behind",
])  # fmt: skip
def test_without_the_c_parser_it_is_the_same(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """PyYAML can be built without libyaml; its Python parser gives the same events."""
    monkeypatch.setattr("gen_data.config.yaml_tree._LOADER", yaml.SafeLoader)
    text, fact = NASTY[case]
    second = "a: 1\n---\nb: 2\n"
    assert message_of(second) == told("x.yaml", second, *REFUSED[second])
    assert parse_yaml(TABLETOP, "t.yaml").get("randomizers", 0, "count") is not None
    assert fact in message_of(text)


def test_a_document_at_the_limits_is_read_quickly() -> None:
    """32 levels, 4,096 bytes of text: the limit itself is allowed. 45,000 values in one file."""
    deep = parse_yaml("a: " + "[" * 31 + "]" * 31, "x.yaml")
    long = parse_yaml("a: " + "x" * 4096, "x.yaml")
    assert deep.get("a", *[0] * 30) is not None
    assert len(long.plain()["a"]) == 4096
    text = "a:\n" + "  - {x: 1.5, y: [1, 2]}\n" * 6_000
    begun = time.process_time()
    document = parse_yaml(text, "x.yaml")
    assert len(document.plain()["a"]) == 6_000
    assert time.process_time() - begun < 10.0


# --- files


def test_a_file_is_read_by_its_path(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("a: 1\n")
    document = load_yaml(path)
    assert document.plain() == {"a": 1}
    assert str(document.position) == f"{path}:1:1"


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"a: 1\nb: \xff\n", ":2:4: not UTF-8: byte 0xff; save the file as UTF-8"),
        ("a: 1\n".encode("utf-16"), ":1:1: not UTF-8: byte 0xff; save the file as UTF-8"),
        (b"a: \xed\xa0\x80", ":1:4: not UTF-8: byte 0xed; save the file as UTF-8"),
        (b"#" * (1024 * 1024 + 1), ":1:1: larger than 1048576 bytes"),
    ],
)
def test_files_that_are_no_text_are_refused(tmp_path: Path, data: bytes, message: str) -> None:
    """The size is checked before anything is decoded."""
    path = tmp_path / "a.yaml"
    path.write_bytes(data)
    with pytest.raises(ConfigError) as caught:
        load_yaml(path)
    assert str(caught.value) == f"{path}{message}"


def test_what_is_no_readable_file_is_refused(tmp_path: Path) -> None:
    """Missing files, folders, pipes and impossible names."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path, fact in [
        (tmp_path / "absent.yaml", "cannot be read: No such file or directory"),
        (tmp_path, "is not a regular file"),
        (pipe, "is not a regular file"),
        (Path("a\0b"), "is not a file name"),
    ]:
        with pytest.raises(ConfigError, match=fact):
            load_yaml(path)


# --- fuzz

ALPHABET = "abc:,-[]{}&*!|>'\"%@#? \n\t\\0123456789.~\x00\x85\ufeff\ud800é😀"


def outcome_of(text: str) -> str:
    try:
        node = parse_yaml(text, "f.yaml")
        node.plain()
    except ConfigError as error:
        return str(error)
    return "read"


def assert_read_or_refused(text: str) -> None:
    """A tree or a ConfigError with a place, whatever the text."""
    assert outcome_of(text).startswith(("read", "f.yaml:"))


@settings(max_examples=1500, deadline=None, derandomize=True)
@given(st.text(ALPHABET, max_size=60))
@example("? ? ? :\n")
@example("&a &b c: 1")
@example("- - - \n  -")
@example("a: |9999\n x")
@example("{? a, ? b}")
@example("[? a : b]")
def test_any_text_gives_a_tree_or_an_error(text: str) -> None:
    """No other exception leaves the reader."""
    assert_read_or_refused(text)


@settings(max_examples=400, deadline=None, derandomize=True)
@given(st.data())
def test_any_mutation_of_a_valid_document_gives_a_tree_or_an_error(data: st.DataObject) -> None:
    """Bytes exchanged, deleted and repeated in a file that was fine."""
    mutated = bytearray(TABLETOP.encode())
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(mutated) - 1))
        new = data.draw(st.binary(max_size=3))
        mutated[at : at + data.draw(st.integers(0, 3))] = new or b" "
    try:
        text = bytes(mutated).decode()
    except UnicodeDecodeError:
        text = bytes(mutated).decode("latin-1")
    assert_read_or_refused(text)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(data=st.binary(max_size=40))
def test_all_bytes_are_told_about(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "fuzz.yaml"
    path.write_bytes(data)
    try:
        outcome = type(load_yaml(path).plain()).__name__
    except ConfigError as error:
        outcome = str(error)
    assert outcome.startswith(("dict", str(path)))
