"""English: turns of phrase that a technical writer avoids do not spread.

``tests/documents/english.yaml`` has the number of them that a file may still have; other files have
none. ``python -m tests.documents.test_english`` writes the table again and refuses larger numbers.
"""

import ast
import itertools
import re
import sys
from collections import Counter
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import pytest
import yaml

from tests.repository import ROOT, repository_files

TABLE = ROOT / "tests/documents/english.yaml"
COMMENTS = {
    **dict.fromkeys((".yaml", ".yml", ".toml", ".sh"), r"^[^\"'\n]*?#(?!!) ?(.*)"),
    **dict.fromkeys((".h", ".js"), r"(?:^|\s)//(.*)"),
}
"""Comments of files whose other text is data or code, by ending."""
EXEMPT = {
    *("CHANGELOG.md", "docs/migration.md"),  # history
    "tests/documents/test_english.py",  # has the phrases
}

TICS = {
    "noun clause with what": r"\bwhat\b(?![^.\n]*\?)",
    "those of, that of": r"\bthose (?:of|that|which|in|with|on|from)\b|\bthat of\b",
    "thing": r"\bthings?\b",
    "so that": r"\bso that\b",
    "things that speak": r"\b(?:says|knows|asks|tells)\b",
    "of its own": r"\bof (?:its|their|his|one's|our) own\b|\b(?:of|by) ours\b",
    "rare adverbs": r"\b(?:anew|likewise|hardly|beside)\b",
    "is no": r"(?<!there )\b(?:is|are) no (?!longer\b|more\b|less\b)",
    "attribute that begins with Of": r"^ +(?:\w+, )*\w+: Of\b",
}
"""Patterns by name, without regard to capitals."""
TIC = re.compile("|".join(f"(?:{tic})" for tic in TICS.values()), re.IGNORECASE | re.MULTILINE)
CODE = re.compile(r"^```.*?^```$|``[^`\n]+``|`[^`\n]*`|\]\([^)\s]*\)", re.MULTILINE | re.DOTALL)
PATH = re.compile(r"[\w.:]+")
"""Keys, and names of modules and their objects."""
COMMENT = re.compile(r"^[^\"']*# (.*)", re.MULTILINE)
NAME = re.compile(r"(?<=^        )\w+(?=: )", re.MULTILINE)
"""Names of parameters and attributes in docstrings."""


@cache
def files() -> Mapping[str, tuple[Path, ...]]:
    """Documents, modules, and other files with comments, by their folder, two levels deep."""
    endings = {".md", ".py", *COMMENTS}
    names = [name for name in repository_files() if Path(name).suffix in endings]
    found: dict[str, tuple[Path, ...]] = {}
    for name in sorted(set(names) - EXEMPT):
        folder = "/".join(name.split("/")[:-1][:2])
        found[folder] = (*found.get(folder, ()), ROOT / name)
    return found


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def prose(path: Path) -> str:
    """Text of a document, strings and comments of a module, or comments, without code."""
    text = path.read_text("utf-8")
    if path.suffix == ".md":
        return CODE.sub("", text)
    if path.suffix in COMMENTS:
        comments = re.findall(COMMENTS[path.suffix], text, re.MULTILINE)
        return CODE.sub("", "\n".join(comments))
    strings = (
        node.value
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Constant) and type(node.value) is str
    )
    texts = (one for one in strings if not PATH.fullmatch(one))
    return NAME.sub("name", CODE.sub("", "\n".join([*texts, *COMMENT.findall(text)])))


def tics(text: str) -> Counter[str]:
    """The phrases of a text, in small letters, with their numbers."""
    return Counter(match.group().strip().lower() for match in TIC.finditer(text))


@cache
def allowed() -> dict[str, int]:
    read: dict[str, int] = yaml.safe_load(TABLE.read_text("utf-8")) or {}
    return read


@pytest.mark.parametrize("folder", files())
def test_a_file_has_no_more_than_it_had(folder: str) -> None:
    """A smaller number is entered into the table, so that it never rises again."""
    found = {name_of(path): tics(prose(path)) for path in files()[folder]}

    assert {n: dict(one) for n, one in found.items() if one.total() > allowed().get(n, 0)} == {}


def test_the_table_lists_files_that_exist() -> None:
    """Files without such phrases are not in it."""
    names = {name_of(path) for paths in files().values() for path in paths}

    assert all(name in names and number > 0 for name, number in allowed().items())


def test_phrases_are_found_and_plain_english_is_not() -> None:
    """Two sentences of a technical writer, and their counterparts."""
    bad = "What hangs lies beside those of others, so that a thing of its own knows it is no file."
    good = "Anything that hangs is next to the others. There is no file, what would change it?"

    assert tics(bad).total() == 8
    assert tics(good).total() == 0


def main() -> None:
    before = allowed() if TABLE.exists() else {}
    paths = itertools.chain(*files().values())
    found = {name_of(path): tics(prose(path)).total() for path in paths}
    risen = [name for name, number in found.items() if number > before.get(name, 0)]
    if before and risen:
        sys.exit("more than before: " + ", ".join(risen))
    lines = [f"{name}: {number}\n" for name, number in found.items() if number]
    TABLE.write_text("# Allowed by tests/documents/test_english.py\n" + "".join(lines), "utf-8")


if __name__ == "__main__":
    main()
