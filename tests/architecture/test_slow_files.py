"""CI runs a fifth of the files with slow tests, and all that changed."""

import subprocess
from pathlib import Path

from tests.slow_files import ROOT, changed_files, choose, marked_files

FILES = [f"tests/test_{k}.py" for k in range(300)]


def test_five_commits_that_follow_each_other_run_all_files_once() -> None:
    shares = [choose(FILES, (), f"{number:040x}") for number in (5, 6, 7, 8, 9)]
    assert sorted(file for share in shares for file in share) == sorted(FILES)
    assert all(40 < len(share) < 80 for share in shares)


def test_changed_files_run_whatever_the_commit() -> None:
    others = ["tests/test_3.py", "generator/core/scene.py"]
    for number in (5, 6, 7, 8, 9):
        assert "tests/test_3.py" in choose(FILES, others, f"{number:040x}")
        assert "generator/core/scene.py" not in choose(FILES, others, f"{number:040x}")


def commit(root: Path, name: str, text: str, hour: int) -> None:
    (root / name).write_text(text)
    when = f"2024-05-01T{hour:02}:00:00Z"
    person = {f"GIT_{role}_{fact}": "a@b.c" for role in ("AUTHOR", "COMMITTER")
              for fact in ("NAME", "EMAIL")}  # fmt: skip
    dates = {"GIT_AUTHOR_DATE": when, "GIT_COMMITTER_DATE": when}
    environment = {"PATH": "/usr/bin:/bin", "HOME": str(root), **person, **dates}
    for command in (("init", "-q"), ("add", name), ("commit", "-q", "-m", name)):
        subprocess.run(["git", *command], cwd=root, check=True, env=environment)


def test_recent_changes_are_those_of_three_hours_before_the_commit(tmp_path: Path) -> None:
    """Whenever CI runs."""
    for name, hour in (("old.py", 1), ("first.py", 7), ("second.py", 9)):
        commit(tmp_path, name, "", hour)
    assert sorted(changed_files(tmp_path)) == ["first.py", "second.py"]


def test_a_file_whose_words_alone_changed_did_not_change(tmp_path: Path) -> None:
    """Comments and docstrings; the value that a function returns is a change."""
    for hour, words in ((1, "one"), (8, "two")):
        text = f'"""{words}."""\n\n\ndef f() -> int:\n    """{words}."""\n    return 1  # {words}\n'
        commit(tmp_path, "words.py", text, hour)
        commit(tmp_path, "value.py", text.replace("return 1", f"return {hour}"), hour)
        commit(tmp_path, "notes.md", words, hour)
    assert sorted(changed_files(tmp_path)) == ["notes.md", "value.py"]


def test_files_with_marks_are_found() -> None:
    found = marked_files(ROOT / "tests")
    assert "tests/study/test_study.py" in found
    assert "tests/contracts/test_every_draw.py" in found
    assert "tests/sensors/test_faults.py" not in found
