"""Lines made ready to be sent: their radios opened, their nodes asked, each plan checked; nothing moves for that."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from curveline.driving.lines.interrupted_lines import InterruptedLines, LineSoFar
from curveline.driving.lines.lines_wish import LinesWish, LineWish, radio_groups
from curveline.driving.lines.naming import NamedListener, errors_of
from curveline.driving.lines.sending_lines import PreparedLines, ReadyLine
from curveline.driving.run_listener import RunListener
from curveline.driving.session import Session
from curveline.driving.tours import Tour
from curveline.errors import CurvelineError, LinkError
from curveline.plan_file import Plan
from curveline.radio.host.journal import ReopenedJournal
from curveline.radio.host.node_status import SILENT, NodeStatus
from curveline.radio.host.stop_causes import Cause, Halt, named_display
from curveline.radio.host.together import opened_together


@dataclass(frozen=True)
class LinesSite:
    """Where lines are sent from: the folder of runs, who hears of it, whether somebody `touched` the rods."""

    runs: Path
    listener: RunListener
    touched: bool = False


@contextmanager
def prepared_lines(wish: LinesWish, site: LinesSite) -> Iterator[PreparedLines]:
    """Lines, planned where shapes are wished, and checked against nodes and rods, ready to be sent.

    Errors name the line. Raises what `Session.prepared` does.
    """
    with ExitStack() as opened:
        sessions = _sessions(wish.lines, range(len(wish.lines)), site, opened)
        plans = []
        for line, (session, _) in zip(wish.lines, sessions, strict=True):
            with errors_of(line.name):
                plans.append(session.checked(line.wish, touched=site.touched and isinstance(line.wish, Tour)))
        lines = tuple(replace(line, wish=plan) for line, plan in zip(wish.lines, plans, strict=True))
        ready = tuple(
            ReadyLine(number, line, plan, session.outlet, group, session.radio.now_us() / 1e6)
            for number, (line, plan, (session, group)) in enumerate(zip(lines, plans, sessions, strict=True), start=1)
        )
        yield PreparedLines(replace(wish, lines=lines), ready, site.runs, site.listener)


@contextmanager
def prepared_rest(broken: InterruptedLines, site: LinesSite) -> Iterator[PreparedLines]:
    """What is left of a run that was broken off, ready to be gone on with; its record stays locked in the context.

    Lines that are done are left alone, and so are those that cannot go on, of which the listener is told.
    """
    with ExitStack() as opened:
        places = [place for place, line in enumerate(broken.lines) if line.is_left]
        for place in places:
            with errors_of(broken.wish.lines[place].name):
                _check_rod(broken, place, site)
        journal = opened.enter_context(closing(ReopenedJournal(broken.folder)))
        site.listener.note(broken.summary())
        sessions = _sessions(broken.wish.lines, places, site, opened)
        refused: dict[int, CurvelineError] = {
            place: line.refusal for place, line in enumerate(broken.lines) if line.refusal is not None
        }
        ready = []
        for place, (session, group) in zip(places, sessions, strict=True):
            line, far = broken.wish.lines[place], broken.lines[place]
            with errors_of(line.name):
                if (restarted := _ask(session, far)) is not None:
                    refused[place] = restarted
                    continue
            begin = session.radio.now_us() / 1e6
            ready.append(ReadyLine(place + 1, line, far.plan, session.outlet, group, begin, far.point))
        for place, error in sorted(refused.items()):
            site.listener.note(f"line {broken.wish.lines[place].name} does not go on: {error.message}; {error.hint}")
        if not ready:
            raise next(iter(refused.values()))
        left_out = {place + 1: error for place, error in refused.items()}
        yield PreparedLines(broken.wish, tuple(ready), site.runs, site.listener, broken, journal, left_out)


def _check_rod(broken: InterruptedLines, place: int, site: LinesSite) -> None:
    line, far = broken.wish.lines[place], broken.lines[place]
    session = Session(
        line.radio, (line.drive, named_display(far.plan)), site.runs, NamedListener(site.listener, line.name)
    )
    session.check_rest(far.plan, 0 if far.point is None else far.point.point.barrier)


def _ask(session: Session, far: LineSoFar) -> LinkError | None:
    """Ask the nodes of a line that is to go on; why it cannot, if a node was switched off and on since.

    LinkError if one does not answer, or a line that has not moved yet cannot.
    """
    plan, run = far.plan, far.point
    if run is None or not run.point.released:
        session.checked(plan)
        return None
    for node, boot in zip(session.status().nodes, run.point.boots, strict=True):
        if (halt := _why_not(plan, node, boot)) is not None:
            error = LinkError(halt.message, halt.hint, node.node)
            if halt.cause is not Cause.REBOOT:
                raise error
            return error
    return None


def _why_not(plan: Plan, node: NodeStatus, boot: int) -> Halt | None:
    if node.counts is None:
        cause = Cause.SILENT if node.state == SILENT else Cause.IN_LOADER
        return Halt(cause, node.node, display=named_display(plan))
    if node.boot != boot:
        detail = f"boot number {node.boot} instead of {boot}"
        return Halt(Cause.REBOOT, node.node, detail=detail, display=named_display(plan))
    return None


def _sessions(
    lines: Sequence[LineWish], places: Sequence[int], site: LinesSite, opened: ExitStack
) -> list[tuple[Session, int]]:
    """A session with each of the lines at some places, and which radio it is behind; closed with `opened`."""
    found: dict[int, tuple[Session, int]] = {}
    for group, members in enumerate(radio_groups([lines[place].radio for place in places])):
        here = [places[member] for member in members]
        drives, spec = [lines[place].drive for place in here], lines[here[0]].radio
        with errors_of(*(lines[place].name for place in here)):
            radios = opened.enter_context(opened_together(spec, drives, site.runs))
        for place, radio in zip(here, radios, strict=True):
            line = lines[place]
            listener = NamedListener(site.listener, line.name)
            session = Session(spec, (line.drive, _named(line)), site.runs, listener, radio)
            found[place] = session, group
    return [found[place] for place in places]


def _named(line: LineWish) -> str:
    """How commands find the display of a line."""
    wish = line.wish
    return named_display(wish) if isinstance(wish, Plan) else wish.display.path or wish.display.name
