"""One configuration of each kind of world, killed and resumed: the bytes of an unbroken run."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.end_to_end.running import command, digest, environment, gen_data

NAMES = ("arm_tasks", "drone", "indoor_rgbd", "kitti_rig", "robot_vacuum", "rooms")
N = 3
WAIT_S = 600


def generate(name: str, out: Path) -> list[str]:
    options = f"--config {name}.yaml --n {N} --workers 1 --set shard_size=1 --out"
    return [*options.split(), str(out)]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_killed_after_a_shard_and_resumed_it_is_the_same_data_set(
    tmp_path: Path, name: str
) -> None:
    """SIGKILL of the whole process group as soon as the first of three shards is committed."""
    whole = gen_data(*generate(name, tmp_path / "whole"), cwd=tmp_path)
    assert whole.returncode == 0, whole.stderr

    out = tmp_path / "killed"
    with subprocess.Popen(
        command(*generate(name, out)), cwd=tmp_path, env=environment(),
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
    ) as process:  # fmt: skip
        end_s = time.monotonic() + WAIT_S
        while not list(out.glob("shards/*.json")) and time.monotonic() < end_s:
            time.sleep(0.005)
        os.killpg(process.pid, signal.SIGKILL)
    assert 1 <= len(list(out.glob("shards/*.json"))) < N, "killed too late, or nothing was made"

    resumed = gen_data(*generate(name, out), cwd=tmp_path)
    assert resumed.returncode == 0, resumed.stderr
    assert digest(out) == digest(tmp_path / "whole")
