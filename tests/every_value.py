"""One test for many values, where thousands of tests would take longer to start than to run."""

from collections.abc import Callable, Iterable
from typing import Any


def for_every(
    values: Iterable[Any], make: Callable[[Any], Any] | None = None
) -> Callable[[Callable[[Any], None]], Callable[[], None]]:
    """Decorate a check of one value: the test runs it for all, and lists every value that fails.

    Args:
        values: Values, in the order of the checks.
        make: Function of a value whose result is checked, or None to check the value.
    """

    def decorate(check: Callable[[Any], None]) -> Callable[[], None]:
        def test() -> None:
            failures = []
            for value in values:
                try:
                    check(make(value) if make else value)
                except AssertionError as error:
                    failures.append(f"{value}: {error}")
            assert not failures, "\n\n".join(failures)

        # functools.wraps would make pytest look for a fixture with the name of the argument.
        test.__doc__, test.__module__ = check.__doc__, check.__module__
        return test

    return decorate
