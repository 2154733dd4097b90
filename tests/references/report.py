"""What was compared with which reference, and by how much it missed: one line per row of the reference table."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Worst:
    """The comparison of a row that missed by most, and how many there were."""

    ours: float
    reference: float
    deviation: float
    count: int


@dataclass
class Report:
    """Asserts that numbers meet a reference, and remembers the worst miss per row."""

    rows: dict[str, Worst] = field(default_factory=dict)

    def __call__(
        self, row: str, ours: ArrayLike, reference: ArrayLike, within: float, scale: ArrayLike | None = None
    ) -> None:
        """Hold `ours` against `reference`, numbers or arrays, to `within` times `scale`, by default the reference.

        A row begins with the section of the reference table: "A Euler loads". Of several calls with the same row the
        worst is reported; the scale is needed where the reference is 0.
        """
        values, wanted = np.broadcast_arrays(np.atleast_1d(ours), np.asarray(reference, dtype=float))
        deviations = (abs(values - wanted) / (abs(wanted) if scale is None else scale)).ravel()
        assert np.all(np.isfinite(deviations)), f"{row}: ours {values}, reference {wanted}"
        place = int(np.argmax(deviations))
        before = self.rows.get(row)
        count = deviations.size + (before.count if before else 0)
        worst = Worst(float(values.ravel()[place]), float(wanted.ravel()[place]), float(deviations[place]), count)
        if before and before.deviation > worst.deviation:
            worst = Worst(before.ours, before.reference, before.deviation, count)
        self.rows[row] = worst
        assert deviations[place] <= within, f"{row}: ours {values}, reference {wanted}, off by {deviations}"

    def lines(self) -> list[str]:
        """The rows in order, as text."""
        return [
            f"{row:<58} reference {worst.reference:<16.10g} ours {worst.ours:<16.10g} "
            f"relative deviation {worst.deviation:.1e}, worst of {worst.count}"
            for row, worst in sorted(self.rows.items())
        ]
