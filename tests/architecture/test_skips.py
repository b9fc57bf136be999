"""In CI a skipped test is a failed one."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.architecture.test_rules import ROOT

CASES = """
import pytest

def test_skips() -> None:
    pytest.skip("a library is missing")

@pytest.mark.skipif(True, reason="root may write everywhere")
def test_may_skip() -> None:
    pass
"""
MODULE = "import pytest\npytest.importorskip('missing_library')"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ci", "result"), [("", "3 skipped"), ("1", "1 failed, 1 skipped, 1 error")]
)
def test_a_skip_fails_in_ci_unless_it_is_allowed(tmp_path: Path, ci: str, result: str) -> None:
    """Skips of tests and of modules; without GEN_DATA_CI, skips stay skips."""
    (tmp_path / "test_it.py").write_text(CASES)
    (tmp_path / "test_module.py").write_text(MODULE)

    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-c", os.devnull, "-p", "tests.conftest",
         "-p", "no:cacheprovider", "-p", "no:dash", "--continue-on-collection-errors",
         str(tmp_path)],
        cwd=ROOT, capture_output=True, text=True, check=False,
        env={**os.environ, "GEN_DATA_CI": ci, "PYTEST_ADDOPTS": ""},
    )  # fmt: skip

    assert done.stdout.splitlines()[-1].startswith(result), done.stdout
