"""What is done in the campaign alone."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def only(values: Iterable[Any]) -> list[Any]:
    """Parameters of a test that the campaign has besides those of every time."""
    return [pytest.param(value, marks=pytest.mark.campaign) for value in values]
