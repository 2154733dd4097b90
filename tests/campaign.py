"""What is done in the campaign alone."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def only(values: Iterable[Any]) -> list[Any]:
    """Parameters of a test that the campaign has besides those of every time."""
    rows = (value if isinstance(value, tuple) else (value,) for value in values)
    return [pytest.param(*row, marks=pytest.mark.campaign) for row in rows]
