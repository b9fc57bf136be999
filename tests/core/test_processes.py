"""Helper processes and the process that started them."""

import re
import signal
import subprocess
import sys
from pathlib import Path

from tests.runner.test_processes import processes_of_session, wait_for

PARENT = (
    "import subprocess, sys, time\n"
    "from gen_data.core.processes import interrupts_blocked, tie\n"
    "with interrupts_blocked():\n"
    "    helper = subprocess.Popen(tie(['sleep', '600']))\n"
    "print(helper.pid, flush=True)\n"
    "time.sleep(600)\n"
)


def test_a_helper_survives_ctrl_c_and_ends_with_its_parent() -> None:
    """The parent decides at Ctrl-C; if it is killed, the kernel ends the helper."""
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert parent.stdout is not None
    helper = int(parent.stdout.readline())
    command = Path(f"/proc/{helper}/cmdline")
    wait_for(lambda: command.read_bytes() == b"sleep\x00600\x00")

    ignored = re.search(r"SigIgn:\s*(\w+)", Path(f"/proc/{helper}/status").read_text())
    assert ignored is not None
    assert int(ignored[1], 16) & 1 << (signal.SIGINT - 1)

    parent.kill()
    parent.communicate()
    wait_for(lambda: processes_of_session(parent.pid) == [])
