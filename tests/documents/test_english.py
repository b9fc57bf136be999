"""English: turns of phrase that a technical writer avoids do not spread.

``tests/documents/english.yaml`` has the number of them that a file may still have; other files have
none. ``python -m tests.documents.test_english`` writes the table again and refuses larger numbers.
"""

import ast
import re
import sys
from collections import Counter
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "tests/documents/english.yaml"
DOCUMENTS = ("*.md", "docs/*.md", "docs/decisions/*.md", "docs/tutorials/*.md", "examples/**/*.md")
FOLDERS = (
    *("annotations", "api", "assemble", "assets", "cli", "config", "core", "physics", "pipeline"),
    *("packs", "preview", "report", "roads", "rooms", "runner", "sensors", "sky", "traffic", "usd"),
)
LABORATORY = ("carry_over", "certificate", "environment", "matching", "study", "write")
SOURCES = (
    *(f"generator/{folder}/**/*.py" for folder in FOLDERS),
    *(f"lab/{folder}/**/*.py" for folder in LABORATORY),
    *(f"{folder}/**/*.py" for folder in ("randomizers", "scene_templates", "exporters")),
)
HISTORY = {"CHANGELOG.md", "docs/migration.md"}

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


def files() -> list[Path]:
    """Documents and the modules whose texts users read."""
    paths = {path for pattern in (*DOCUMENTS, *SOURCES) for path in ROOT.glob(pattern)}
    return [path for path in sorted(paths) if name_of(path) not in HISTORY]


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def prose(path: Path) -> str:
    """Text of a document, or all strings and comments of a module, without code."""
    text = path.read_text("utf-8")
    if path.suffix == ".md":
        return CODE.sub("", text)
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


def allowed() -> dict[str, int]:
    read: dict[str, int] = yaml.safe_load(TABLE.read_text("utf-8")) or {}
    return read


@pytest.mark.parametrize("path", files(), ids=name_of)
def test_a_file_has_no_more_than_it_had(path: Path) -> None:
    """A smaller number is entered into the table, so that it never rises again."""
    found = tics(prose(path))

    assert found.total() <= allowed().get(name_of(path), 0), dict(found)


def test_the_table_lists_files_that_exist() -> None:
    """Files without such phrases are not in it."""
    names = {name_of(path) for path in files()}

    assert all(name in names and number > 0 for name, number in allowed().items())


def test_phrases_are_found_and_plain_english_is_not() -> None:
    """Two sentences of a technical writer, and their counterparts."""
    bad = "What hangs lies beside those of others, so that a thing of its own knows it is no file."
    good = "Anything that hangs is next to the others. There is no file, what would change it?"

    assert tics(bad).total() == 8
    assert tics(good).total() == 0


def main() -> None:
    before = allowed() if TABLE.exists() else {}
    found = {name_of(path): tics(prose(path)).total() for path in files()}
    risen = [name for name, number in found.items() if number > before.get(name, 0)]
    if before and risen:
        sys.exit("more than before: " + ", ".join(risen))
    lines = [f"{name}: {number}\n" for name, number in found.items() if number]
    TABLE.write_text("# Allowed by tests/documents/test_english.py\n" + "".join(lines), "utf-8")


if __name__ == "__main__":
    main()
