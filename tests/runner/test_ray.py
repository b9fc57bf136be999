"""A cluster of three machines: a run on it is interrupted, loses a machine, and loses a worker."""

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gen_data.core.errors import ConfigError, Interrupted
from gen_data.runner.ray_cluster import RayCluster
from gen_data.runner.run import Settings, Summary, run
from tests.runner import doubles

N, SHARD_SIZE = 40, 2


@pytest.fixture
def cluster() -> Iterator[Any]:
    """The head of a cluster, to which the test adds machines; the driver is connected."""
    import ray
    from ray.cluster_utils import Cluster

    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    ray.init(address=made.address, log_to_driver=False, logging_level="ERROR")
    yield made
    ray.shutdown()
    made.shutdown()


def make(out: Path, trouble: doubles.Trouble, workers: int = 0) -> Summary:
    """A data set, made in this process or by workers on the cluster."""
    cluster = RayCluster(cpus=1.0)
    return run(
        replace(doubles.fake_plan(N, SHARD_SIZE), versions={}),
        doubles.FakeFactory(N, trouble),
        out,
        Settings(workers, write_media=doubles.write_raw_images, open_pool=cluster.open_pool),
    )


def after_shards(out: Path, count: int, act: Callable[[], None]) -> threading.Thread:
    """Start a thread that acts once so many shards are committed."""

    def wait() -> None:
        while len(list((out / "shards").glob("*.json"))) < count:
            time.sleep(0.02)
        act()

    thread = threading.Thread(target=wait)
    thread.start()
    return thread


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # Ray's own
def test_lost_machines_and_workers_change_no_byte(tmp_path: Path, cluster: Any) -> None:
    lost = cluster.add_node(num_cpus=1)
    cluster.add_node(num_cpus=1)
    cluster.wait_for_nodes()
    assert RayCluster(cpus=1.0).worker_count() == 3
    assert RayCluster(cpus=0.5, gpus=0.25).worker_count() == 1
    make(tmp_path / "here", doubles.Trouble())
    out = tmp_path / "ray"
    trouble = doubles.Trouble(delay_s=0.15, killed_once_at=31, marker=str(tmp_path / "marker"))
    interrupting = after_shards(out, 3, lambda: os.kill(os.getpid(), signal.SIGINT))
    with pytest.raises(Interrupted):
        make(out, trouble, workers=3)
    interrupting.join()
    losing = after_shards(out, 8, lambda: cluster.remove_node(lost, allow_graceful=False))
    summary = make(out, trouble, workers=3)
    losing.join()
    notes = doubles.notes_of(out)
    assert any("lost with machine" in note for note in notes)
    assert any("ended: " in note for note in notes)
    assert summary.worker_deaths == 2
    assert summary.cpu_s["render"] == pytest.approx(0.25)
    assert doubles.tree_digest(out) == doubles.tree_digest(tmp_path / "here")


def test_wrong_resources_and_addresses_are_refused() -> None:
    with pytest.raises(ConfigError, match="expected numbers of 0 or more"):
        RayCluster(gpus=-1.0)
    with pytest.raises(ConfigError, match="expected auto or HOST:PORT"):
        RayCluster("ray://head:10001")
