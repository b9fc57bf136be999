"""The quick profile of ``python -m benchmarks.faults``, without what other tests do at this size.

Campaigns that need a program or a privilege that is not there are not collected; their rows in the
table of the command say why.
"""

import ast
import os
import shutil
from pathlib import Path

import pytest

from benchmarks.faults.__main__ import CAMPAIGNS, run_campaign
from benchmarks.faults.memory import CGROUP
from benchmarks.faults.results import Result, Scale

CHOSEN = [
    "bit_flips",
    "objects",
    "foreign",
    "derived",
    "caches",
    "environments",
    "samples_alone",
    "structured_configurations",
    "mutated_configurations",
    *(["kills_at_calls", "errnos_at_calls"] if shutil.which("strace") else []),
    *(["out_of_memory"] if os.access(CGROUP / "cgroup.procs", os.W_OK) else []),
]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::gen_data.ConfigWarning")  # tiny images show little
@pytest.mark.parametrize("name", CHOSEN)
def test_every_promise_holds(name: str) -> None:
    """A sample of the attempts of docs/trust.md."""
    result = run_campaign(name, Scale(is_full=False))

    assert result.failures == []
    assert result.held == result.attempts > 0


def test_a_broken_promise_is_counted_and_described() -> None:
    """The first failures are kept; the others are counted."""
    result = Result()
    for number in range(30):
        result.add(number % 2 == 0, f"attempt {number}")

    assert (result.attempts, result.held, result.is_clean) == (30, 15, False)
    assert result.failures[:2] == ["attempt 1", "attempt 3"]
    assert len(result.failures) == 10


def test_attempts_after_the_time_limit_are_stated_as_left_out() -> None:
    """They are not counted as held."""
    result = Result()

    assert list(result.until_end(Scale(is_full=True, end_s=0.0), range(7))) == []
    assert result.skipped == {"7 of 7 attempts": "the time was up"}


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_every_campaign_exists(name: str) -> None:
    """The table of the command names modules and functions."""
    module, function = CAMPAIGNS[name].split(":")
    path = Path(__file__).parents[2] / f"benchmarks/faults/{module}.py"

    functions = {
        node.name: [argument.arg for argument in node.args.args]
        for node in ast.parse(path.read_text("utf-8")).body
        if isinstance(node, ast.FunctionDef)
    }
    assert functions[function] == ["scale", "folder"]
