"""Decisions by topic: short pages of complete entries, whose names of code exist."""

import re
from functools import cache
from pathlib import Path, PurePosixPath

import pytest

from tests.repository import ROOT, repository_files

PAGES = sorted({*ROOT.glob("docs/decisions/*.md")} - {ROOT / "docs/decisions/README.md"})
PARTS = ("Answer", "Because", "Would change if")
MOST_ENTRIES = 12
CODE = {".py", ".yaml", ".toml", ".h", ".txt", ".html", ".js"}
"""Endings of the files whose words are names of code."""
OF_OLD_NAMES = {"generator/config/renamed_keys.yaml", "tests/documents/test_decisions.py"}

ENTRY = re.compile(r"^##+ (.+?)\n(.*?)(?=^##+ |\Z)", re.MULTILINE | re.DOTALL)
PART = re.compile(r"^- \*\*([\w ]+?)[.:]?\*\*[ ]", re.MULTILINE)
SPAN = re.compile(r"`([^`\n]+)`")
WORD = re.compile(r"[A-Za-z_]\w*")
FILE = re.compile(r"[\w.-]*\w\.(?:py|yaml|toml|json|jsonl|md|h)|(?:[\w.-]+/)+[\w.-]*")


def entries(text: str) -> dict[str, str]:
    """Texts of entries by heading, in the order of the page."""
    found = ENTRY.findall(text)
    headings = [heading for heading, _ in found]
    assert len(set(headings)) == len(headings), "two entries with the same heading"
    return dict(found)


def parts(entry: str) -> list[str]:
    """Names of the parts of an entry, in order."""
    return PART.findall(entry)


@cache
def paths() -> frozenset[str]:
    files = map(PurePosixPath, repository_files())
    return frozenset(str(path) for file in files for path in (file, *file.parents))


@cache
def source() -> str:
    """Text of all source files and configurations, with their names."""
    names = [name for name in sorted(paths() - OF_OLD_NAMES) if (ROOT / name).is_file()]
    files = [ROOT / name for name in names if Path(name).suffix in CODE or name == ".ci/run"]
    return "\n".join([*names, *(file.read_text("utf-8") for file in files)])


@cache
def words() -> frozenset[str]:
    return frozenset(WORD.findall(source()))


def exists(file: str) -> bool:
    """Whether a file or folder is in the repository, or is one that the program writes."""
    path = file.rstrip("/")
    written = path.endswith((".json", ".jsonl", ".md")) and path in source()
    return written or any(f"/{known}".endswith(f"/{path}") for known in paths())


def missing_names(text: str) -> list[str]:
    """Words and paths in backticks that the repository does not have."""
    spans = SPAN.findall(text)
    missing = [word for span in spans for word in WORD.findall(span) if word not in words()]
    return missing + [file for span in spans for file in FILE.findall(span) if not exists(file)]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_entry_has_question_answer_reason_and_what_would_change_it(page: Path) -> None:
    """In this order; a page has at most twelve entries."""
    found = entries(page.read_text("utf-8"))

    assert 1 <= len(found) <= MOST_ENTRIES
    assert {heading: parts(entry) for heading, entry in found.items()} == {
        heading: list(PARTS) for heading in found
    }


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_names_of_code_exist(page: Path) -> None:
    """Symbols, keys and files in backticks; names of foreign software stand without them."""
    assert missing_names(page.read_text("utf-8")) == []


def test_no_question_is_answered_twice() -> None:
    """Headings of all pages are different."""
    headings = [heading for page in PAGES for heading in entries(page.read_text("utf-8"))]

    assert len({heading.lower() for heading in headings}) == len(headings)


def test_incomplete_entries_and_stale_names_are_found() -> None:
    """Deliberate faults: a missing part, two equal headings, a symbol and files that are gone."""
    assert parts("- **Answer.** Yes.\n- **Because:** it is.\n") == ["Answer", "Because"]
    with pytest.raises(AssertionError, match="same heading"):
        entries("## Why?\nA\n## Why?\nB\n")
    assert missing_names("`Scene`, `core/scene.py`, `scene.py`, `docs/decisions/`") == []
    assert missing_names("`Zcene`") == ["Zcene"]
    assert missing_names("`assets/scene.py`") == ["assets/scene.py"]
