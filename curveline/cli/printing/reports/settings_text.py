"""What nodes get in the way of settings, as text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from curveline.cli.printing import screen
from curveline.driving.new_settings import HEAD, Resettled, SettingsChange
from curveline.phrases import wrapped


def describe_change(change: SettingsChange) -> Iterator[str]:
    """What is to change, and what follows from that; limits are counts, counts/s and counts/s^2."""
    if change.rows():
        yield from screen.table([HEAD, *change.rows()], frozenset({1, 2, 3}))
    same = [each.node for each in change.nodes if not each.is_due]
    tried = [each.node for each in change.nodes if each.on_trial]
    if same:
        yield f"as it should be: {_nodes(same)}"
    if tried:
        yield f"on trial, to be kept: {_nodes(tried)}"
    moved = [each.node for each in change.nodes if each.is_due and each.moved]
    if moved:
        yield from wrapped(f"to be homed anew, since number or limits change: {_nodes(moved)}", 0)


def describe_done(done: Sequence[Resettled]) -> Iterator[str]:
    """What came of it."""
    changed = [each.node for each in done if each.changed]
    unhomed = [each.node for each in done if each.must_home]
    if changed:
        yield f"changed: {_nodes(changed)}"
    if unhomed:
        yield f"not homed: {_nodes(unhomed)}: `curveline node home N`"


def _nodes(numbers: Sequence[int]) -> str:
    return ("node " if len(numbers) == 1 else "nodes ") + ", ".join(map(str, numbers))
