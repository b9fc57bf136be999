"""Workers on a Ray cluster, in place of processes on this machine.

The supervisor decides as on one machine; here, a worker is an actor and a shard is a task. Ray
repeats nothing by itself (``max_restarts`` and ``max_task_retries`` are 0): the supervisor assigns
the shard of a lost worker again, and a shard that was committed twice has the same bytes.
"""

import pickle
import time
from collections.abc import Iterator
from dataclasses import dataclass
from socket import socket
from typing import TYPE_CHECKING, Any

from gen_data.core import processes, system_calls
from gen_data.runner.ray_worker import Placed, ShardWorker
from gen_data.runner.worker_events import (
    Action,
    Assign,
    Dismiss,
    Event,
    Exited,
    Failed,
    Kill,
    Queued,
    Spawn,
    Tick,
)

if TYPE_CHECKING:
    from gen_data.runner.shard import Job

FAILED = 1
"""Exit code of a worker without one."""
STEP_S = 0.1
"""Longest wait for Ray without a look at Ctrl-C [s]."""


@dataclass
class _Actor:
    handle: Any
    stream: Any
    node: str = ""
    is_leaving: bool = False


class RayPool:
    """The workers of one run on the connected cluster. A context manager: leaves no actor behind.

    Actors wait for resources, which shows an autoscaler the missing ones.

    Args:
        job: Work of the workers; its folder exists on all machines, or is a URL.
        cpus: CPU cores per worker.
        gpus: GPUs per worker.
    """

    def __init__(self, job: "Job", *, cpus: float, gpus: float) -> None:
        import ray

        self._ray = ray
        self._job = ray.put(pickle.dumps(job))
        self._make_actor = ray.remote(ShardWorker).options(
            num_cpus=cpus,
            num_gpus=gpus,
            max_restarts=0,
            max_task_retries=0,
            runtime_env={"env_vars": dict.fromkeys(processes.SINGLE_THREADED, "1")},
        )
        self._actors: dict[int, _Actor] = {}
        self._ended: list[Exited] = []

    def __enter__(self) -> "RayPool":
        """Start without workers."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Kill the remaining actors, which cancels their tasks."""
        for number in tuple(self._actors):
            self._end(Exited(number, 0))

    def execute(self, action: Action) -> None:
        """Execute one action; actions on a worker that has ended do nothing."""
        if isinstance(action, Spawn):
            handle = self._make_actor.remote(action.worker, self._job)
            stream = handle.start.options(num_returns="streaming").remote()
            self._actors[action.worker] = _Actor(handle, stream)
        elif isinstance(action, (Assign, Dismiss, Kill)) and action.worker in self._actors:
            self._command(self._actors[action.worker], action)

    def _command(self, actor: _Actor, action: Assign | Dismiss | Kill) -> None:
        if isinstance(action, Assign):
            name = f"shard {action.shard}"
            task = actor.handle.make.options(num_returns="streaming", name=name)
            actor.stream = task.remote(action.shard, action.failed)
        elif isinstance(action, Dismiss):
            actor.is_leaving = True
            actor.stream = actor.handle.leave.remote()
        else:
            self._end(Exited(action.worker, system_calls.KILLED))

    def events(self, wake: socket, timeout_s: float) -> Iterator[Event]:
        """Wait for an event or the timeout; yield all events since the last call.

        Ray waits for no file descriptor: ``wake`` is left to the caller, after a short wait.
        """
        del wake
        streams = {a.stream: n for n, a in self._actors.items() if a.stream is not None}
        for stream in self._ready(list(streams), min(timeout_s, STEP_S)):
            yield from self._read(streams[stream], stream)
        ended, self._ended = self._ended, []
        yield from ended
        for number, actor in sorted(self._actors.items()):
            if not actor.node:
                yield Queued(number)
        yield Tick()

    def _ready(self, streams: list[Any], timeout_s: float) -> list[Any]:
        """Streams with a batch or an end; waits for the first one."""
        if not streams:
            time.sleep(timeout_s)
            return []
        ready, others = self._ray.wait(streams, timeout=timeout_s, fetch_local=False)
        if not ready or not others:
            return list(ready)
        more, _ = self._ray.wait(others, num_returns=len(others), timeout=0, fetch_local=False)
        return [*ready, *more]

    def _read(self, number: int, stream: Any) -> Iterator[Event]:
        """Events of the next batch of a stream, or the end of its worker."""
        actor = self._actors.get(number)
        if actor is None or actor.stream is not stream:
            # Ended or assigned again by the reaction to an earlier event.
            return
        if actor.is_leaving:
            self._end(Exited(number, 0))
            return
        try:
            batch = self._ray.get(next(stream))
        except StopIteration:
            actor.stream = None
            return
        except self._ray.exceptions.RayError as error:
            self._end(self._describe_end(number, actor, error))
            return
        for event in batch:
            if isinstance(event, Placed):
                actor.node = event.node
                continue
            yield event
            if isinstance(event, Failed):
                self._end(Exited(number, FAILED))

    def _end(self, exited: Exited) -> None:
        """Kill an actor, whether or not it still lives; its end is among the next events."""
        actor = self._actors.pop(exited.worker, None)
        if actor is not None:
            self._ray.kill(actor.handle, no_restart=True)
            self._ended.append(exited)

    def _describe_end(self, number: int, actor: _Actor, error: Exception) -> Exited:
        exceptions = self._ray.exceptions
        if isinstance(error, exceptions.OutOfMemoryError):
            return Exited(number, system_calls.KILLED, out_of_memory=True)
        living = {node["NodeID"] for node in self._ray.nodes() if node["Alive"]}
        # A machine that lives reports the death of its worker. Ray notices the loss of a
        # machine after seconds only; until then, the worker is unavailable.
        lost = isinstance(error, exceptions.ActorUnavailableError)
        if actor.node and (lost or actor.node not in living):
            cause = f"lost with machine {actor.node[:8]}"
            return Exited(number, FAILED, cause=cause, machine_lost=True)
        return Exited(number, FAILED, cause=f"ended: {_last_line(error)}")


def _last_line(error: Exception) -> str:
    """The line of an error of Ray that names the cause."""
    return str(error).strip().splitlines()[-1].strip()[:200]
