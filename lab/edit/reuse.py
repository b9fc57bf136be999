"""Scenes that a changed text leaves as before, kept with all their inputs.

Randomizers and physics are pure functions of the scene, their settings and their random stream. A
call with the same scene (the same object), the same settings and the same stream has the same
result: after a change of one randomizer, only the later ones run again.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from types import TracebackType

    from gen_data.core.interfaces import PhysicsEngine, Settled
    from gen_data.core.scene import Scene

V = TypeVar("V")

KEPT = 1500
"""Number of results kept: a street has forty randomizers, and a grid up to 24 scenes."""


@dataclass
class Memory:
    """The latest results by their arguments.

    Attributes:
        limit: Largest number of results; the least recently used is dropped first.
    """

    limit: int = KEPT
    _kept: OrderedDict[Hashable, tuple[object, object]] = field(default_factory=OrderedDict)

    def get(self, source: object, settings: Hashable, make: Callable[[], V]) -> V:
        """The result of a function of one object and of settings.

        Args:
            source: Compared by identity; it is kept with the result.
            settings: Everything else that the result depends on.
            make: The function; its exceptions are not kept.
        """
        key = id(source), settings
        known = self._kept.get(key)
        if known is not None and known[0] is source:
            self._kept.move_to_end(key)
            return known[1]  # type: ignore[return-value]
        value = make()
        self._kept[key] = source, value
        while len(self._kept) > self.limit:
            self._kept.popitem(last=False)
        return value


@dataclass
class RememberingPhysics:
    """A physics engine that settles no scene twice.

    Attributes:
        engine: The engine.
        settings: Its settings as text.
    """

    engine: PhysicsEngine
    settings: str
    memory: Memory

    def __enter__(self) -> PhysicsEngine:
        """Start the engine."""
        self.engine.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop the engine."""
        self.engine.__exit__(kind, error, trace)

    def settle(self, scene: Scene) -> Settled:
        """Settle a scene."""
        settings = ("settle", self.settings)
        return self.memory.get(scene, settings, lambda: self.engine.settle(scene))
