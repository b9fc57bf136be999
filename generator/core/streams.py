"""Random streams: stateless, keyed by name and independent of the order of draws.

The key of a stream is a digest of (seed, scene, view, step, attempt, name). Adding, removing or
reordering plug-ins changes no other stream, and any sample can be generated on its own.
Counter-based generator: Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC 2011.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import blake2b

import numpy as np


class Rng(np.random.Generator):
    """A numpy generator with the key of its stream.

    Attributes:
        index: Scene index for draws that all views share, else the number of the view in the
            data set. Index of a ``sequence`` in YAML, which makes distributions stateless.
        name: Name of the stream.
        streams: The family it belongs to.
    """

    index: int = 0
    name: str = ""
    streams: "Streams"

    def of_sequence(self) -> "Rng":
        """A new stream of the same name that is the same at all steps of the sequence.

        Processes that continue from step to step, like the bias of a gyroscope, are redrawn from it
        at every step, from the beginning of the sequence.
        """
        return replace(self.streams, step=0).rng(f"{self.name}/sequence")


@dataclass(frozen=True, slots=True)
class Streams:
    """The family of random streams of one attempt at one scene or view.

    Attributes:
        seed: Seed of the data set, >= 0; 0 is a seed like any other.
        scene: Scene index.
        view: View index within the scene, or -1 for draws that all views of a scene share.
        attempt: Number of the attempt, from 0.
        index: Value of ``Rng.index``.
        step: Step of a sequence, for draws that differ between steps.
    """

    seed: int
    scene: int
    view: int = -1
    attempt: int = 0
    index: int = 0
    step: int = 0

    def rng(self, name: str) -> Rng:
        """The generator of the stream ``name``."""
        view = f"{self.view}.{self.step}" if self.step else str(self.view)
        text = "\0".join((str(self.seed), str(self.scene), view, str(self.attempt), name))
        key = blake2b(text.encode(), digest_size=16).digest()
        rng = Rng(np.random.Philox(key=int.from_bytes(key, "little")))
        rng.index, rng.name, rng.streams = self.index, name, self
        return rng


def pick_by_weight(weights: Sequence[float], draw: float) -> int:
    """Index of one of several, in proportion to its weight, for a draw in [0, 1)."""
    left = draw * sum(weights)
    for k, weight in enumerate(weights):
        left -= weight
        if left < 0.0:
            return k
    return len(weights) - 1
