"""Tables of text: columns as wide as they must be, headings that name what several columns have in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from curveline.phrases import WIDTH

Row = Sequence[str]


class Heading(NamedTuple):
    """What the columns from `first` to `last` have in common, such as a unit."""

    title: str
    first: int
    last: int


class Columns(NamedTuple):
    """How wide the columns of some rows are, the heading among them, and which of them are aligned to the left."""

    widths: Sequence[int]
    left: frozenset[int]
    groups: Sequence[Heading] = ()

    @property
    def gap(self) -> int:
        """Columns of the terminal between those of the table: two, where it has room for that."""
        return 2 if sum(self.widths) + 2 * (len(self.widths) - 1) <= WIDTH else 1

    def lines(self, rows: Sequence[Row]) -> list[str]:
        """Rows as text."""
        return [self._line(row) for row in rows]

    def heading(self, head: Row) -> list[str]:
        """The heading as text, below what columns have in common."""
        return [*([self._above()] if self.groups else []), self._line(head)]

    def _line(self, row: Row) -> str:
        cells = zip(row, self.widths, strict=True)
        return (
            (" " * self.gap)
            .join(
                cell.ljust(width) if index in self.left else cell.rjust(width)
                for index, (cell, width) in enumerate(cells)
            )
            .rstrip()
        )

    def _above(self) -> str:
        """The line over the heading: every title ends where its last column does."""
        line = ""
        for group in self.groups:
            end = sum(self.widths[: group.last + 1]) + self.gap * group.last
            line = f"{line}{group.title:>{max(0, end - len(line))}}"
        return line


def fitting(rows: Sequence[Row], left: frozenset[int] = frozenset({0}), groups: Sequence[Heading] = ()) -> Columns:
    """A table whose columns are as wide as these rows and groups ask for."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    for title, first, last in groups:
        # A title that is longer than what it stands over begins two columns after the one before.
        room = sum(widths[first : last + 1]) + 2 * (last - first)
        widths[first] += max(0, len(title) - room)
    return Columns(widths, left, groups)
