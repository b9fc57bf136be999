"""Procedural assets keep their bytes as long as they keep their version."""

from pathlib import Path

import pytest

from tests.contracts.asset_digests import digests_of, numerics, open_procedural, read_stored


@pytest.mark.slow
def test_families_with_other_bytes_have_another_version(tmp_path: Path) -> None:
    """Else raise ``version`` in its table, then ``python -m tests.contracts.asset_digests``."""
    stored_numerics, stored = read_stored()
    if numerics() != stored_numerics:
        pytest.skip("this machine computes otherwise than the one that stored the digests")

    assert digests_of(open_procedural(tmp_path)) == stored
