"""What a comparison found, as JSON and CSV: mm, and percentages of the vertical range."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator

from curveline.comparing.agreement import Comparison, SegmentAgreement, in_mm
from curveline.comparing.measures import heights_at

COLUMNS = ("shape", "segment", "wanted", "state", "x_mm", "mean_mm", "deviation_mm")


def to_json(found: Comparison, argv: tuple[str, ...] = ()) -> bytes:
    """The document as one line."""
    return (json.dumps(found.document(argv), allow_nan=False) + "\n").encode()


def to_csv(found: Comparison, argv: tuple[str, ...] = ()) -> bytes:
    """A row per place of a mean curve: its height, the standard deviation between trials, and every stable state's."""
    names = list(dict.fromkeys(each.name for shape in found.shapes for part in shape.segments for each in part.curves))
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow((*COLUMNS, *(f"{name}_mm" for name in names)))
    for shape in found.shapes:
        for number, part in enumerate(shape.segments, start=1):
            writer.writerows(_rows((shape.scene.name, number, part.wanted, part.state), part, names))
    return stream.getvalue().encode()


def _rows(head: tuple[object, ...], part: SegmentAgreement, names: list[str]) -> Iterator[tuple[object, ...]]:
    by_name = {each.name: heights_at(each.points, part.x) for each in part.curves} if part.x.size else {}
    for place, x in enumerate(part.x.tolist()):
        deviation = in_mm(float(part.deviation[place])) if part.deviation.size else None
        heights = [by_name.get(name) for name in names]
        told = [None if each is None else in_mm(float(each[place])) for each in heights]
        yield *head, in_mm(x), in_mm(float(part.mean[place])), deviation, *told
