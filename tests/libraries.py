"""What comes with the package, opened once for all tests."""

from functools import cache

from gen_data.assets.library import Library, open_library


@cache
def library() -> Library:
    return open_library(())
