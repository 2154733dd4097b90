"""What tests of drawings share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from drawings.curves import written


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str, str | bytes], Path]:
    """What writes a file into a folder of the test's own."""
    return written(tmp_path)
