"""Random streams: stateless, keyed by what draws, never by when it draws.

A stream's key is a digest of (seed, scene, view, step, attempt, name). Adding, removing or
reordering whatever draws leaves every other stream as it was, and any sample can be made alone.
Counter-based generator: Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC 2011.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from hashlib import blake2b

import numpy as np


class Rng(np.random.Generator):
    """A numpy generator that also knows what it draws for.

    Attributes:
        index: Scene index for draws that all views share, else the number of the view in the
            data set. What a ``sequence`` in YAML steps by, so that no distribution needs a memory.
        name: What draws from it.
        streams: The family it belongs to.
    """

    index: int = 0
    name: str = ""
    streams: Streams

    def of_sequence(self) -> Rng:
        """A new stream of the same name that all instants of the sequence share.

        What goes on from one instant to the next, like the bias of a gyroscope, is drawn from it
        anew at every instant, from the beginning of the sequence.
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
        index: What ``Rng.index`` will be.
        step: Instant of a sequence, for draws that differ from one to the next.
    """

    seed: int
    scene: int
    view: int = -1
    attempt: int = 0
    index: int = 0
    step: int = 0

    def rng(self, name: str) -> Rng:
        """The generator of everything that ``name`` draws."""
        view = f"{self.view}.{self.step}" if self.step else str(self.view)
        text = "\0".join((str(self.seed), str(self.scene), view, str(self.attempt), name))
        key = blake2b(text.encode(), digest_size=16).digest()
        rng = Rng(np.random.Philox(key=int.from_bytes(key, "little")))
        rng.index, rng.name, rng.streams = self.index, name, self
        return rng
