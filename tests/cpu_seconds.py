"""Processor time per test file: ``python -m pytest -p tests.cpu_seconds``.

Unlike durations, it does not depend on what else the machine does. It includes fixtures, which
count for the test that needs them first, and processes that have ended.
"""

import os
from collections import Counter
from collections.abc import Generator
from pathlib import Path

import pytest

FILES_SHOWN = 10
_BEFORE_S = pytest.StashKey[float]()


def pytest_collection_finish(session: pytest.Session) -> None:
    session.config.stash[_BEFORE_S] = _used_s()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Note the time since the report before; xdist sends it on."""
    report = yield
    now_s, before_s = _used_s(), item.config.stash[_BEFORE_S]
    item.config.stash[_BEFORE_S] = now_s
    report.cpu_s = now_s - before_s
    return report


def _used_s() -> float:
    return sum(os.times()[:4])


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """List the files that take most, and all tests in the file ``GEN_DATA_TEST_SECONDS``."""
    tests: Counter[str] = Counter()
    for reports in terminalreporter.stats.values():
        for report in reports:
            tests[getattr(report, "nodeid", "")] += getattr(report, "cpu_s", 0.0)
    files: Counter[str] = Counter()
    for test, cpu_s in tests.items():
        files[test.partition("::")[0]] += cpu_s
    terminalreporter.section(f"{files.total():.0f} CPU s; files that take most")
    for file, cpu_s in files.most_common(FILES_SHOWN):
        terminalreporter.write_line(f"{cpu_s:8.1f} {file}")
    if path := os.environ.get("GEN_DATA_TEST_SECONDS"):
        rows = (f"{cpu_s:.3f}\t{test}\n" for test, cpu_s in tests.most_common())
        Path(path).write_text("".join(rows))
