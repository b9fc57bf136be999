"""Words of the page while the first picture is prepared."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from gen_data.assets.library import open_library
from gen_data.core import activity
from gen_data.lab.edit.workers import Activity, Ready, _ask

CHILD = """
import pickle, sys
from gen_data.lab.edit.workers import Activity, Reply
pickle.load(sys.stdin.buffer)
for message in (Activity("making mug", 1), Activity("making bowl", 5), Reply("done", 7)):
    pickle.dump(message, sys.stdout.buffer)
"""


def test_assets_are_named_while_they_are_made(tmp_path: Path) -> None:
    """Once: the next library finds them in the cache."""
    heard: list[str] = []
    activity.listen(heard.append)
    try:
        for _ in range(2):
            open_library([], tmp_path).mesh("banana?seed=2")
    finally:
        activity.forget(heard.append)
    assert heard == ["making banana?seed=2"]


def test_activities_come_before_the_reply_of_a_process() -> None:
    """In their order; the reply is the same as without them."""
    heard: list[Activity] = []
    command = [sys.executable, "-c", CHILD]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        reply = _ask(child, Ready(), heard.append)
    assert [(one.text, one.count) for one in heard] == [("making mug", 1), ("making bowl", 5)]
    assert reply is not None
    assert (reply.result, reply.memory_bytes) == ("done", 7)
