"""Displays and shapes of any number of segments, those of the benchmarks: every wanted state exists."""

from __future__ import annotations

from curveline.bench.many_segments import PATTERN as PATTERN
from curveline.bench.many_segments import row as row
from curveline.bench.many_segments import row_display as row_display
