"""The supervisor's decisions, simulated: virtual workers, virtual clock, seeded faults."""

from gen_data.core import errors
from gen_data.runner import worker_events as events
from gen_data.runner.supervisor import Limits, Supervisor

SHARD_SIZE = 4


def samples_of(shard: int) -> range:
    return range(shard * SHARD_SIZE, (shard + 1) * SHARD_SIZE)


def make_supervisor(shards: int, workers: int, **limits: float) -> Supervisor:
    limited = Limits(**limits)  # type: ignore[arg-type]
    return Supervisor(range(shards), samples_of, workers, "make-alone {}".format, limited)


def with_ready_workers(shards: int, workers: int, **limits: float) -> Supervisor:
    supervisor = make_supervisor(shards, workers, **limits)
    supervisor.start(0.0)
    for number in range(workers):
        supervisor.handle(events.Ready(number), 1.0)
    return supervisor


def test_no_more_processes_than_shards_are_started_and_go_home_after_the_last() -> None:
    """Two shards need two of eight workers."""
    assert make_supervisor(shards=2, workers=8).start(0.0) == [events.Spawn(0), events.Spawn(1)]
    # One worker, one shard: assign, dismiss, finished when it is gone.
    supervisor = make_supervisor(shards=1, workers=1)
    supervisor.start(0.0)
    assert supervisor.handle(events.Ready(0), 1.0) == [events.Assign(0, 0)]
    assert supervisor.handle(events.ShardDone(0, 0, 4, 100, 0), 2.0) == [events.Dismiss(0)]
    assert not supervisor.finished
    assert supervisor.handle(events.Exited(0, 0), 3.0) == []
    assert supervisor.finished
    assert supervisor.error is None


def test_a_dead_workers_shard_goes_to_the_next_and_an_abort_kills_all() -> None:
    """The replacement gets the same shard, before any new one."""
    supervisor = with_ready_workers(shards=3, workers=1)
    after_death = supervisor.handle(events.Exited(0, -9), 2.0)
    assert events.Spawn(1) in after_death
    assert supervisor.handle(events.Ready(1), 3.0) == [events.Assign(1, 0)]
    # Ctrl-C: busy, idle and starting workers alike.
    supervisor = make_supervisor(shards=9, workers=3)
    supervisor.start(0.0)
    supervisor.handle(events.Ready(0), 1.0)
    actions = supervisor.handle(events.Abort(errors.Interrupted("stop")), 2.0)
    assert actions == [events.Kill(0), events.Kill(1), events.Kill(2)]
    assert not supervisor.finished


def test_a_shard_that_kills_three_workers_is_given_up_and_named() -> None:
    """The message has shard, sample in flight, signal and the command for that sample."""
    supervisor = make_supervisor(shards=1, workers=1)
    supervisor.start(0.0)
    for number in range(3):
        supervisor.handle(events.Ready(number), 1.0)
        supervisor.handle(events.SampleDone(number, 0, 0), 1.5)
        supervisor.handle(events.Exited(number, -11), 2.0)
    assert supervisor.finished
    assert isinstance(supervisor.error, errors.WorkerLost)
    assert str(supervisor.error) == (
        "shard 0: its worker process died 3 times, at last in sample 1: "
        "killed by signal 11 (SIGSEGV).\n  Reproduce: make-alone 1"
    )


def test_a_silent_worker_is_killed_and_its_shard_made_by_another_unless_it_is_done() -> None:
    """After the limit and not before; waiting for work does not count as silence."""
    supervisor = make_supervisor(shards=1, workers=1, silence_s=30.0)
    supervisor.start(0.0)
    supervisor.handle(events.Ready(0), 10.0)
    assert supervisor.handle(events.Tick(), 40.0) == []
    assert events.Kill(0) in supervisor.handle(events.Tick(), 40.1)
    assert events.Kill(0) not in supervisor.handle(events.Tick(), 50.0)
    assert events.Spawn(1) in supervisor.handle(events.Exited(0, -9), 51.0)
    # The commit counts, and the doomed worker gets no new shard.
    supervisor = make_supervisor(shards=2, workers=1, silence_s=30.0)
    supervisor.start(0.0)
    supervisor.handle(events.Ready(0), 0.0)
    supervisor.handle(events.Tick(), 31.0)
    late = supervisor.handle(events.ShardDone(0, 0, 4, 100, 0), 31.1)
    assert [a for a in late if isinstance(a, events.Assign)] == []
    supervisor.handle(events.Exited(0, -9), 31.2)
    assert supervisor.handle(events.Ready(1), 32.0) == [events.Assign(1, 1)]


def test_a_rejected_scene_lets_others_finish_their_shard_a_storage_fault_stops_all() -> None:
    """The others would only meet the same full disk."""
    supervisor = with_ready_workers(shards=9, workers=2)
    error = errors.SceneRejected(3, ())
    assert supervisor.handle(events.Failed(0, error), 2.0) == []
    assert supervisor.handle(events.Exited(0, 1), 2.1) == []
    assert supervisor.handle(events.ShardDone(1, 1, 4, 100, 0), 3.0) == [events.Dismiss(1)]
    supervisor.handle(events.Exited(1, 0), 3.1)
    assert supervisor.finished
    assert supervisor.error is error
    supervisor = with_ready_workers(shards=9, workers=2)
    assert events.Kill(1) in supervisor.handle(
        events.Failed(0, errors.StorageError("disk full")), 2.0
    )


def test_processes_that_never_start_end_the_run_if_none_succeeds() -> None:
    """Three deaths in a row before the first Ready; no endless respawning."""
    supervisor = make_supervisor(shards=9, workers=1)
    supervisor.start(0.0)
    for number in range(3):
        supervisor.handle(events.Exited(number, 1), 1.0)
    assert supervisor.finished
    assert isinstance(supervisor.error, errors.WorkerLost)
    assert "while they start: exited with status 1" in str(supervisor.error)
    # Only deaths in a row count.
    supervisor = make_supervisor(shards=9, workers=1)
    supervisor.start(0.0)
    supervisor.handle(events.Exited(0, 1), 1.0)
    supervisor.handle(events.Exited(1, 1), 1.0)
    supervisor.handle(events.Ready(2), 1.0)
    supervisor.handle(events.Exited(2, 1), 1.0)
    supervisor.handle(events.Exited(3, 1), 1.0)
    assert supervisor.error is None
    assert not supervisor.finished


def test_workers_that_grew_are_replaced_between_shards_and_fewer_go_on_out_of_memory() -> None:
    """Two workers, one killed by the kernel: one goes on alone."""
    supervisor = with_ready_workers(shards=9, workers=2)
    actions = supervisor.handle(events.Exited(0, -9, out_of_memory=True), 2.0)
    assert not any(isinstance(a, events.Spawn) for a in actions)
    # Dismissed after its shard, and a new one is started.
    supervisor = with_ready_workers(shards=9, workers=1, rss_bytes=1000)
    assert supervisor.handle(events.ShardDone(0, 0, 4, 100, 0, rss_bytes=600), 2.0) == [
        events.Assign(0, 1)
    ]
    actions = supervisor.handle(events.ShardDone(0, 1, 4, 100, 0, rss_bytes=1001), 2.0)
    assert events.Dismiss(0) in actions
    assert events.Spawn(1) in actions
    # Its scenes need the memory: a new worker would need it again.
    supervisor = with_ready_workers(shards=9, workers=1, rss_bytes=1000)
    for shard, rss_bytes in enumerate((1200, 1790)):
        event = events.ShardDone(0, shard, 4, 100, 0, rss_bytes=rss_bytes)
        assert supervisor.handle(event, 2.0) == [events.Assign(0, shard + 1)]
