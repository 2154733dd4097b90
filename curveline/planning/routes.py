"""Ways from where a rod's states are known to a shape: in which order, by way of what, in how many steps.

The first is the paper's (section V): extrude, bias, translate. Where that loses the state, other orders are tried, then
steps that bias and translate at once, then ways on which there is more rod between the nodes than in the end: the less
straight a rod is, the larger the angles that its states survive.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from curveline.planning.feeding import CLOSE, Room, schedule
from curveline.planning.layout import SAME, Layout, angles_of, centred, heights_of, lengths_of, posed
from curveline.planning.moves import HALVINGS, Leg, Travel, advance, check_reach
from curveline.planning.verification import Refused, Verifier

RECIPE = ("extrude", "bias", "translate")
ORDERS = (
    ("extrude", "translate", "bias"),
    ("bias", "extrude", "translate"),
    ("translate", "extrude", "bias"),
    ("bias", "translate", "extrude"),
    ("translate", "bias", "extrude"),
    ("extrude", "swing"),
    ("swing", "extrude"),
    ("move",),
)
OVERFED = (("bias", "translate"), ("translate", "bias"), ("swing",))
EXTRA = (0.04, 0.1, 0.2)
"""Rod beyond what the shape takes, as a fraction of the span, that the last ways have in between."""
GIVES = (0.16, 0.1, 0.06, 0.03)
"""By how much, as a fraction of the span, a segment may grow while rod is fed through it to the next."""

Way = tuple[tuple[str, Layout], ...]
"""Actions, each with the layout whose share of it is reached."""


def _extrude(verifier: Verifier, travel: Travel, goal: Layout) -> Travel:
    """Feed rod to where `goal` has it; one step even if nothing moves.

    In a row, in even waves if any do: where steps must be cut smaller, no segment meets a length twice, and each is
    proven anew. Refused before any of them is proven if a node would feed more than it can tell.
    """
    check_reach(verifier, goal)
    for give in GIVES if len(travel.stage.holds) > 1 else ():
        try:
            return _feed(verifier, travel, goal, (give, 0))
        except Refused:
            continue
    return _feed(verifier, travel, goal, (GIVES[-1], HALVINGS))


def _feed(verifier: Verifier, travel: Travel, goal: Layout, care: tuple[float, int]) -> Travel:
    """Feed rod with segments that may grow by a fraction of the span, in steps that may be halved so many times."""
    give, halvings = care
    layout = travel.stage.layout
    room = _room(verifier, layout, goal, give)
    for feeds in list(schedule(verifier.display.span, layout.feeds, goal.feeds, room)) or [goal.feeds]:
        travel = advance(verifier, travel, Leg("extrude", Layout(layout.nodes, feeds), halvings=halvings))
    return travel


def _room(verifier: Verifier, layout: Layout, goal: Layout, give: float) -> Room:
    """How short and how long segments may get on the way: not shorter than at its ends, but longer by `give`."""
    display = verifier.display
    longest = display.limits.length.high
    pairs = list(zip(lengths_of(display, layout), lengths_of(display, goal), strict=True))
    return Room(
        tuple(min(pair) for pair in pairs),
        tuple(max(*pair, min(max(pair) + give * display.span, longest)) for pair in pairs),
    )


LEGS: Mapping[str, Callable[[Layout, Layout], Layout]] = {
    "extrude": lambda here, goal: Layout(here.nodes, goal.feeds),
    "bias": lambda here, goal: posed(here, angles_of(goal), heights_of(here)),
    "translate": lambda here, goal: posed(here, angles_of(here), heights_of(goal)),
    "swing": lambda here, goal: posed(here, angles_of(goal), heights_of(goal)),
    "move": lambda _, goal: goal,
}
"""What a leg is called -> where it leads: `swing` biases and translates at once, `move` does everything at once."""


def travel_along(verifier: Verifier, travel: Travel, way: Way) -> Travel:
    """Go on along `way`, leg by leg; Refused where a step is."""
    for action, goal in way:
        if action == "extrude":
            travel = _extrude(verifier, travel, goal)
        else:
            travel = advance(verifier, travel, Leg(action, LEGS[action](travel.stage.layout, goal)))
    return travel


def ways(verifier: Verifier, layout: Layout, goal: Layout) -> Iterator[Way]:
    """Ways worth trying other than the recipe, the plainest first; legs that change nothing are left out."""
    for order in ORDERS:
        yield _needed(layout, tuple((action, goal) for action in order))
    for extra in EXTRA:
        fed = overfed(verifier, layout, goal, extra)
        for order in OVERFED:
            legs = (("extrude", fed), *((action, goal) for action in order), ("extrude", goal))
            yield _needed(layout, legs)


def overfed(verifier: Verifier, layout: Layout, goal: Layout, extra: float) -> Layout:
    """A layout with more rod in every segment than either of two others, by a fraction of the span."""
    display = verifier.display
    longer = [
        min(max(pair) + extra * display.span, display.limits.length.high)
        for pair in zip(lengths_of(display, layout), lengths_of(display, goal), strict=True)
    ]
    return centred(display, goal.nodes, longer)


def _needed(layout: Layout, way: Way) -> Way:
    """A way without the legs in which nothing would move; the last one stays if none is needed."""
    kept = []
    for action, goal in way:
        after = LEGS[action](layout, goal)
        if _differ(layout, after):
            kept.append((action, goal))
            layout = after
    return tuple(kept) or way[-1:]


def _differ(one: Layout, other: Layout) -> bool:
    pairs = (
        (one.feeds, other.feeds, CLOSE),
        (angles_of(one), angles_of(other), SAME),
        (heights_of(one), heights_of(other), SAME),
    )
    return any(abs(a - b) > slack for first, second, slack in pairs for a, b in zip(first, second, strict=True))
