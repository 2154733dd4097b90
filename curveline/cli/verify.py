"""What `curveline send --verify` does: sends shape by shape, shows what the camera saw, asks before it leads back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from curveline.cli import consent
from curveline.cli.printing import screen
from curveline.cli.run import Means, Named
from curveline.cli.terminal import TERMINAL
from curveline.driving.session import connect
from curveline.driving.tours import Tour
from curveline.driving.wishes import Wish
from curveline.errors import EXIT_DONE, EXIT_INTERRUPTED, EXIT_NO, InvalidInput
from curveline.plan_file import Plan
from curveline.radio.host.actions import Policy
from curveline.radio.host.link import Control

if TYPE_CHECKING:
    from curveline.driving.looking.looks import Look
    from curveline.driving.looking.verified import VerifiedTour, VerifyRequest
    from curveline.scene import Scene

OFFERED = 3
"""How often a way back is offered for a shape."""


@dataclass(frozen=True)
class Verifying:
    """What the options of `send` say about looking at the display."""

    source: str | None
    camera: str | None
    recover: int | None
    pictures: str | None

    def checked(self, named: Named, *, is_dry: bool) -> Verifying | None:
        """The same, None if nobody wants to look; InvalidInput for options that go with nothing else."""
        if self.source is None:
            if self.camera is None and self.recover is None and self.pictures is None:
                return None
            hint = 'say where they come from, such as --verify "rpicam-still -n -o {}"'
            raise InvalidInput("--camera, --recover and --pictures are for pictures of the display", hint)
        if is_dry:
            raise InvalidInput("--verify looks at what was sent, and --dry-run sends nothing", "leave one out")
        if named.folder or named.resume is not None:
            hint = "send the shapes of one display, or its plan"
            raise InvalidInput("--verify is for shapes and plans of one display", hint)
        if not named.files:
            raise InvalidInput("--verify looks at shapes, and home is none", "name a shape")
        return self

    def request(self, means: Means) -> VerifyRequest:
        """How the display is looked at; nobody who cannot be asked is offered a way back."""
        from curveline.driving.looking.verified import VerifyRequest

        asked = VerifyRequest(self.source or "", self.camera, self.recover or 0, self.pictures, means.touched)
        if self.recover is not None or not means.asks:
            return asked
        return replace(asked, recoveries=OFFERED, agrees=_agrees)


def send_verified_wish(wish: Wish, verifying: Verifying, means: Means, *, as_json: bool) -> int:
    """Send what is wished with a look after each shape, and say what was seen; the exit code."""
    from curveline.driving.looking.verified import looked_at

    if means.asks:
        consent.require_terminal("sending moves the display, and ", "add --yes to agree")
    driven = wish.display if isinstance(wish, Tour) else _plan_of(wish)
    parts: Sequence[Scene | Plan] = wish.scenes if isinstance(wish, Tour) else (_plan_of(wish),)
    control = Control(Policy(takeover=means.takeover), tell=screen.note)
    with (
        connect(means.spec, driven, runs=means.runs, listener=TERMINAL) as session,
        looked_at(session, parts, verifying.request(means)) as looking,
    ):
        if means.asks and not consent.agrees("Move the display?"):
            screen.note("nothing was sent")
            return EXIT_NO
        found = looking.send(control)
        _show(found, as_json=as_json)
        if isinstance(wish, Tour) and wish.ends_home and found.is_wanted:
            session.home(control)
    if found.is_interrupted:
        return EXIT_INTERRUPTED
    return EXIT_DONE if found.is_wanted else EXIT_NO


def _plan_of(wish: Wish) -> Plan:
    """The plan that is wished, where no shapes are; runs that go on are not looked at."""
    if not isinstance(wish, Plan):
        raise InvalidInput("--verify is for shapes and plans of one display")
    return wish


def _agrees(look: Look) -> bool:
    """Whether somebody wants a wrong state led back."""
    return consent.agrees("Lead it back through the funnel?")


def _show(found: VerifiedTour, *, as_json: bool) -> None:
    if as_json:
        screen.emit(found.document())
        return
    for each in found.shapes:
        runs = len(each.runs)
        again = f" after {runs} runs" if runs > 1 else ""
        seen = each.looks[-1].line() if each.looks else "was interrupted"
        screen.result(f"{each.scene.name}{again}: {seen}")
    if not found.is_wanted and not found.is_interrupted:
        screen.advise("send the shape again: that plans from what was seen; with --recover N it is led back by itself")
