"""Loading of samples for training: epochs, shuffling, worker processes, exact resumption.

The order of an epoch is a pure function of seed, epoch and rank. Whole scenes are the unit of
work, because the views of a scene share their physics; the samples of ``mixed_scenes`` scenes are
shuffled together.
"""

import multiprocessing
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from gen_data.api import config, dataset, sample
from gen_data.core import errors, streams

T = TypeVar("T")
Indices = NDArray[np.int64]


class Loader(Generic[T]):
    """Batches of targets, epoch after epoch.

    Every iteration over the loader is one epoch, or the rest of one after ``load_state_dict``.
    Batches depend only on the samples, the seed, the epoch and the rank: neither on the number of
    workers nor on when a run was interrupted.

    Args:
        samples: A ``Dataset``, which is rendered while training, or a finished one.
        target: Function from a Sample to inputs of training, such as the functions of
            ``gen_data.targets``. With workers it must be importable.
        batch_size: Targets per batch; the last batch of an epoch may be smaller.
        shuffle: Whether each epoch has another order.
        seed: Seed of the orders.
        workers: Processes, which start with the first epoch and end with the loader; 0 = this
            process. A script with workers needs the guard ``if __name__ == "__main__":``.
        prefetch: Scenes that each worker may be ahead; bounds the memory.
        mixed_scenes: Number of scenes whose samples are shuffled together.
        rank: Rank of this process among ``world_size`` processes that train together; each has
            its own scenes.
        world_size: Number of these processes.
        epoch_size: Samples per epoch of a ``Dataset`` without a size, of which every epoch has new
            ones: epoch ``e`` has the samples from ``e * epoch_size``.

    Raises:
        ConfigError: an argument is out of range, or there is no sample.

    Warns:
        ConfigWarning: samples of several splits are mixed; ``data.split("train")`` selects one.
    """

    def __init__(  # noqa: PLR0913
        self,
        samples: dataset.SampleSequence,
        target: Callable[[sample.Sample], T],
        *,
        batch_size: int = 1,
        shuffle: bool = False,
        seed: int = 0,
        workers: int = 0,
        prefetch: int = 2,
        mixed_scenes: int = 16,
        rank: int = 0,
        world_size: int = 1,
        epoch_size: int | None = None,
    ) -> None:
        for name, value, least in (
            ("batch_size", batch_size, 1),
            ("workers", workers, 0),
            ("prefetch", prefetch, 1),
            ("mixed_scenes", mixed_scenes, 1),
            ("world_size", world_size, 1),
        ):
            config.check_whole(name, value, least)
        config.check_whole("rank", rank)
        config.check_whole("seed", seed)
        if not 0 <= rank < world_size:
            raise errors.ConfigError(f"rank: {rank}; expected 0 to {world_size - 1}")
        if samples.is_bounded == (epoch_size is not None):
            raise errors.ConfigError(
                "epoch_size: expected for a data set without a size, and for no other"
            )
        if samples.is_bounded and not len(samples):
            raise errors.ConfigError("samples: there are none; expected at least one")
        if isinstance(samples, dataset.SampleSequence):
            samples.warn_of_mixed_splits()
        self._samples, self._target = samples, target
        self._batch_size, self._shuffle, self._seed = batch_size, shuffle, seed
        self._workers, self._prefetch, self._mixed_scenes = workers, prefetch, mixed_scenes
        self._rank, self._world_size, self._epoch_size = rank, world_size, epoch_size
        self._pool: ProcessPoolExecutor | None = None
        self.epoch = 0
        self._position = 0

    def __len__(self) -> int:
        """Batches of a whole epoch."""
        samples = sum(len(block) for block in self._blocks(self.epoch))
        return (samples + self._batch_size - 1) // self._batch_size

    def __iter__(self) -> Iterator[list[T]]:
        """The batches of this epoch that are left; then the next epoch begins.

        Raises:
            SampleError: a sample cannot be generated, or a worker process ended.
        """
        batch: list[T] = []
        for item in self._targets():
            batch.append(item)
            if len(batch) == self._batch_size:
                # Counted before it is handed out: a state saved after a step holds that step.
                self._position += len(batch)
                yield batch
                batch = []
        if batch:
            self._position += len(batch)
            yield batch
        self.epoch, self._position = self.epoch + 1, 0

    def state_dict(self) -> dict[str, int]:
        """Epoch and number of samples of it that were handed out."""
        return {"epoch": self.epoch, "position": self._position, "seed": self._seed}

    def load_state_dict(self, state: dict[str, int]) -> None:
        """Continue where another loader with the same arguments was.

        Raises:
            ConfigError: the other loader had another seed, or this is not a state of a loader.
        """
        if set(state) != set(self.state_dict()):
            raise errors.ConfigError(
                f"state: has the keys {', '.join(map(str, state)) or 'none'}; expected the keys of "
                f"state_dict: {', '.join(self.state_dict())}"
            )
        for name in ("epoch", "position"):
            config.check_whole(name, state[name], 0)
        if state["seed"] != self._seed:
            raise errors.ConfigError(
                f"seed: the state is of a loader with the seed {state['seed']}, this one has "
                f"{self._seed}; expected the same"
            )
        self.epoch, self._position = state["epoch"], state["position"]

    def _blocks(self, epoch: int) -> list[Indices]:
        """Order of the positions in ``samples`` in an epoch of this rank, in mixed blocks."""
        first = 0 if self._epoch_size is None else epoch * self._epoch_size
        size = len(self._samples) if self._epoch_size is None else self._epoch_size
        positions = np.arange(first, first + size)
        scenes = self._samples.scene_indices(positions)
        starts = np.flatnonzero(np.diff(scenes, prepend=-1))
        groups = np.split(positions, starts[1:])
        order = np.arange(len(groups))
        rng = streams.Streams(self._seed, scene=epoch).rng("loader")
        if self._shuffle:
            order = rng.permutation(order)
        own = [groups[k] for k in order[self._rank :: self._world_size]]
        mixed = self._mixed_scenes if self._shuffle else 1
        blocks = [np.concatenate(own[k : k + mixed]) for k in range(0, len(own), mixed)]
        return [rng.permutation(block) for block in blocks] if self._shuffle else blocks

    def _targets(self) -> Iterator[T]:
        left = self._position
        works: list[tuple[Indices, list[Indices]]] = []
        for block in self._blocks(self.epoch):
            rest, left = block[left:], max(0, left - len(block))
            if len(rest):
                scenes = self._samples.scene_indices(rest)
                # Views of a scene in their order, in one work item.
                items = [np.sort(rest[scenes == scene]) for scene in dict.fromkeys(scenes.tolist())]
                works.append((rest, items))
        made = self._make([item for _, items in works for item in items])
        for rest, items in works:
            ready: dict[int, T] = {}
            for item in items:
                ready.update(zip(item.tolist(), next(made), strict=True))
            for position in rest.tolist():
                yield ready.pop(position)

    def _make(self, items: Sequence[Indices]) -> Iterator[list[T]]:
        if self._workers == 0:
            for item in items:
                yield [self._target(self._samples[k]) for k in item.tolist()]
            return
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                self._workers,
                mp_context=multiprocessing.get_context("spawn"),
                initializer=_start_worker,
                initargs=(self._samples, self._target),
            )
        waiting: deque[Future[list[Any]]] = deque()
        try:
            for item in items:
                waiting.append(self._pool.submit(_work, item.tolist()))
                if len(waiting) > self._workers * self._prefetch:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        except BrokenProcessPool as error:
            self._pool = None
            raise errors.SampleError(
                "a worker process of the loader ended, perhaps for lack of memory; use fewer "
                "workers, or workers=0 to see its error"
            ) from error
        finally:
            # Leaving early, as `break` does, must not wait for scenes that nobody wants.
            for future in waiting:
                future.cancel()


_worker: tuple[dataset.SampleSequence, Callable[[sample.Sample], Any]] | None = None
"""Samples and target of this worker process."""


def _start_worker(samples: dataset.SampleSequence, target: Callable[[sample.Sample], Any]) -> None:
    global _worker  # noqa: PLW0603  (set once per process)
    _worker = samples, target


def _work(positions: Sequence[int]) -> list[Any]:
    assert _worker is not None
    samples, target = _worker
    return [target(samples[k]) for k in positions]
