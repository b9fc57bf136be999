"""Caches bounded by bytes, by number of values, or by the life of their values elsewhere."""

from collections import OrderedDict
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar
from weakref import WeakValueDictionary


class Sized(Protocol):
    """An object that reports its memory."""

    @property
    def nbytes(self) -> int:
        """Bytes held."""
        ...


S = TypeVar("S", bound=Sized)
V = TypeVar("V")


class ByteCache(Generic[S]):
    """Values by name; the least recently used go first when a bound is exceeded.

    ``limit`` bounds the number of values whose names never repeat: many small ones take more memory
    than their bytes say.
    """

    def __init__(self, limit_bytes: int, limit: int | None = None) -> None:
        self._limit_bytes = limit_bytes
        self._limit = limit
        self._held_bytes = 0
        self._values: OrderedDict[str, S] = OrderedDict()

    def get(self, name: str, make: Callable[[], S]) -> S:
        """The value of that name, made if it is not there."""
        if name in self._values:
            self._values.move_to_end(name)
            return self._values[name]
        value = make()
        self._values[name] = value
        self._held_bytes += value.nbytes
        while self._is_too_full() and len(self._values) > 1:
            _, dropped = self._values.popitem(last=False)
            self._held_bytes -= dropped.nbytes
        return value

    def _is_too_full(self) -> bool:
        too_many = self._limit is not None and len(self._values) > self._limit
        return too_many or self._held_bytes > self._limit_bytes

    def __len__(self) -> int:
        """How many values are held."""
        return len(self._values)


class CountCache(Generic[V]):
    """Values by name, up to a number of them; the least recently used go first."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._values: OrderedDict[str, V] = OrderedDict()

    def get(self, name: str, make: Callable[[], V]) -> V:
        """The value of that name, made if it is not there."""
        if name in self._values:
            self._values.move_to_end(name)
            return self._values[name]
        value = self._values[name] = make()
        if len(self._values) > self._limit:
            self._values.popitem(last=False)
        return value

    def __contains__(self, name: str) -> bool:
        """Whether the value of that name is held."""
        return name in self._values

    def __len__(self) -> int:
        """How many values are held."""
        return len(self._values)


class HeldCache(Generic[V]):
    """Values by name, for as long as somebody else holds them."""

    def __init__(self) -> None:
        self._values: WeakValueDictionary[str, V] = WeakValueDictionary()

    def get(self, name: str, make: Callable[[], V]) -> V:
        """The value of that name, made if nobody holds it."""
        value = self._values.get(name)
        if value is None:
            value = self._values[name] = make()
        return value

    def __len__(self) -> int:
        """How many values are held."""
        return len(self._values)


class ObjectCache(Generic[V]):
    """Values made of objects that never change, for the latest of these objects.

    Objects are told apart by identity: hashing a scene's thousands of materials takes longer than
    computing the cached values. Values are the same whether cached or not.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._values: OrderedDict[int, tuple[object, V]] = OrderedDict()

    def get(self, source: object, make: Callable[[], V]) -> V:
        """The value of that object, made if it is not there."""
        known = self._values.get(id(source))
        if known is not None and known[0] is source:
            self._values.move_to_end(id(source))
            return known[1]
        value = make()
        self._values[id(source)] = source, value
        if len(self._values) > self._limit:
            self._values.popitem(last=False)
        return value
