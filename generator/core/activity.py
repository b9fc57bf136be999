"""Long preparations of this process, told to whoever shows them."""

from collections.abc import Callable

_listeners: list[Callable[[str], None]] = []


def listen(listener: Callable[[str], None]) -> None:
    """Call a function with the name of every preparation that begins, in any thread."""
    _listeners.append(listener)


def tell(text: str) -> None:
    """Name a preparation that begins, such as ``making mug?seed=3``."""
    for listener in _listeners:
        listener(text)


def forget(listener: Callable[[str], None]) -> None:
    """Call a function no more."""
    _listeners.remove(listener)
