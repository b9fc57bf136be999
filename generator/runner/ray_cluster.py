"""Ray clusters: connection, and the resources of a worker."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gen_data.core import distribution, errors
from gen_data.runner.termination_signals import SIGNALS

if TYPE_CHECKING:
    from gen_data.runner.processes import Pool
    from gen_data.runner.shard import Job


@dataclass(frozen=True)
class RayCluster:
    """A cluster and one worker's share of it; picklable.

    Attributes:
        address: ``auto`` = the cluster of this machine, ``HOST:PORT``, or empty = start one of
            this machine alone for the run.
        cpus: CPU cores per worker.
        gpus: GPUs per worker; 0.25 = four workers share one.
    """

    address: str = ""
    cpus: float = 1.0
    gpus: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        if self.cpus < 0 or self.gpus < 0:
            raise errors.ConfigError(
                f"resources of a worker: {self.cpus:g} CPUs and {self.gpus:g} GPUs; "
                "expected numbers of 0 or more"
            )
        if self.address.startswith("ray://"):
            raise errors.ConfigError(
                f"address: '{self.address}' is a Ray Client; expected auto or HOST:PORT: run the "
                "command on a machine of the cluster, for example by 'ray job submit'"
            )

    @contextmanager
    def connected(self) -> Iterator[None]:
        """Connect this process with the cluster; a cluster that was started here ends with it.

        Raises:
            ConfigError: Ray is not installed, or there is no cluster at the address.
        """
        try:
            import ray
        except ImportError:
            raise errors.ConfigError(
                f"runner ray: Ray is not installed; expected: {distribution.install_command('ray')}"
            ) from None
        if ray.is_initialized():
            yield
            return
        try:
            with _kept_signal_handlers():
                ray.init(
                    address=self.address or "local",
                    log_to_driver=False,
                    logging_level="ERROR",
                    **({} if self.address else {"include_dashboard": False}),
                )
        except (ConnectionError, ValueError, RuntimeError) as error:
            raise errors.ConfigError(
                f"address: no Ray cluster at '{self.address or 'this machine'}' "
                f"({str(error).splitlines()[0]}); expected auto on a machine of a cluster "
                "('ray start --head'), or HOST:PORT"
            ) from None
        try:
            yield
        finally:
            ray.shutdown()

    def worker_count(self) -> int:
        """Number of workers that the machines of the connected cluster can hold now; at least 1."""
        import ray

        total = ray.cluster_resources()
        wanted = {"CPU": self.cpus, "GPU": self.gpus}
        fits = [int(total.get(name, 0) / each) for name, each in wanted.items() if each > 0]
        return max(1, min(fits, default=1))

    def open_pool(self, job: "Job") -> "Pool":
        """Open a pool of workers of the connected cluster."""
        from gen_data.runner.ray_pool import RayPool

        return RayPool(job, cpus=self.cpus, gpus=self.gpus)


@contextmanager
def _kept_signal_handlers() -> Iterator[None]:
    """Restore the handlers of signals that the block replaces, as ``ray.init`` does."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
