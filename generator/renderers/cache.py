"""A cache bounded by bytes."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar


class Sized(Protocol):
    """Something that knows how much memory it holds."""

    @property
    def nbytes(self) -> int:
        """Bytes held."""
        ...


V = TypeVar("V", bound=Sized)


class ByteCache(Generic[V]):
    """Values by name; the least recently used go first when the bound is exceeded."""

    def __init__(self, limit_bytes: int) -> None:
        self._limit_bytes = limit_bytes
        self._held_bytes = 0
        self._values: OrderedDict[str, V] = OrderedDict()

    def get(self, name: str, make: Callable[[], V]) -> V:
        """The value of that name, made if it is not there."""
        if name in self._values:
            self._values.move_to_end(name)
            return self._values[name]
        value = make()
        self._values[name] = value
        self._held_bytes += value.nbytes
        while self._held_bytes > self._limit_bytes and len(self._values) > 1:
            _, dropped = self._values.popitem(last=False)
            self._held_bytes -= dropped.nbytes
        return value
