"""A display behind a radio: how its nodes are, plans from where it stands, sending, going on, stopping."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from curveline.drive_settings import DriveSettings, drive_settings
from curveline.driving.dry_run import DryRun, DrySite, dry_run_of
from curveline.driving.halting import Halting, stop_display
from curveline.driving.interrupted import InterruptedRun
from curveline.driving.known_states import Shown, check_granted, shown_states
from curveline.driving.live import news_of, same_radio, senders
from curveline.driving.modelled import known_rod
from curveline.driving.one_node import OneNode, refuse_while_sending
from curveline.driving.readiness import check_movable, check_ready
from curveline.driving.rod_plans import check_for_rod, rest_of, with_rod_now
from curveline.driving.rod_record import RodRecord, is_fresh
from curveline.driving.run_listener import UNHEARD, RunListener
from curveline.driving.scanning import ScanResult, scan_display
from curveline.driving.sending import Outlet, PreparedRun
from curveline.driving.status import DisplayStatus
from curveline.driving.tours import Tour, Whereabouts, plan_tour, summary
from curveline.driving.wishes import run_to_resume, wish_of
from curveline.errors import LinkError
from curveline.plan_file import Plan
from curveline.radio.host.journal import runs_folder
from curveline.radio.host.link import Control, read_status
from curveline.radio.host.node_status import NodeStatus
from curveline.radio.host.preflight import check_targets
from curveline.radio.host.stop_causes import display_option, named_display
from curveline.radio.interface import InUse, Radio, check_radio, open_radio
from curveline.radio.site.key_file import UNKNOWN_CHIP, lenient, unadopted
from curveline.system.arguments import expect

if TYPE_CHECKING:
    from curveline.driving.adoption import Adoption
    from curveline.driving.new_settings import Formerly, SettingsChange
    from curveline.driving.rod_now import RodNow
    from curveline.driving.run_result import RunResult
    from curveline.driving.runs import Run
    from curveline.driving.wishes import Wish
    from curveline.radio.measuring.channels import ChannelScan
    from curveline.radio.measuring.reach import RangeTest
    from curveline.scene import Display
    from curveline.system.files import AnyPath


def connect(
    radio: str,
    display: AnyPath | Display | Plan = "single",
    *,
    runs: Path | str | None = None,
    listener: RunListener = UNHEARD,
) -> Session:
    """A session with a display; the radio is opened when it is first needed, and given back by `close`.

    `radio` is a spec such as "mock", "serial:/dev/ttyACM0" or "nrf24:22,0"; `display` a built-in name, the path of a
    display file, a `Display`, or the plan that is to be sent. `runs` is the folder of the records of runs, by default
    the user's. Raises InvalidInput for what does not exist.
    """
    expect(radio, str, 'a radio, such as "mock",')
    check_radio(radio)
    drive, named = _drive_of(display)
    return Session(radio, (drive, named), runs_folder() if runs is None else Path(runs), listener)


def _drive_of(display: AnyPath | Display | Plan) -> tuple[DriveSettings, str]:
    """What must be known of a display to drive it, and how advice names it."""
    if isinstance(display, Plan):
        return display.drive, named_display(display)
    if isinstance(display, str | os.PathLike):
        from curveline.shapes.files import given_display

        return drive_settings(given_display(display)), os.fspath(display)
    from curveline.scene import Display

    expect(display, Display, "a display, by name, path, Display or plan,")
    return drive_settings(display), display.path or display.name


class Session:
    """A display behind a radio; use it as a context manager, or `close` it.

    Every method that talks to the nodes raises LinkError, with what to do, where that fails.
    """

    def __init__(
        self,
        spec: str,
        display: tuple[DriveSettings, str],
        runs: Path,
        listener: RunListener = UNHEARD,
        radio: Radio | None = None,
    ) -> None:
        """`radio` is the one that `spec` names if it is open already."""
        self.spec = spec
        self.drive, self.named = display
        self.folder = runs
        self.listener = listener
        self._radio = radio
        self._since = time.time() if radio is not None and is_fresh(spec) else 0.0

    def __repr__(self) -> str:
        return f"<session with display {self.drive.display} over {self.spec}>"

    def __enter__(self) -> Session:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    @property
    def radio(self) -> Radio:
        """The radio, opened."""
        if self._radio is not None and UNKNOWN_CHIP in self._radio.site.chips:
            # It was opened for one node, before all were adopted: opened anew it says which are missing.
            self.close()
        return self._opened()

    def _opened(self) -> Radio:
        if self._radio is None:
            self._since = time.time() if is_fresh(self.spec) else 0.0
            self._radio = open_radio(self.spec, self.drive, self.folder)
        return self._radio

    def close(self) -> None:
        """Give the radio back, so that others can have it; it is opened again when it is needed again."""
        if self._radio is not None:
            self._radio.close()
            self._radio = None

    def status(self) -> DisplayStatus:
        """What every node says now, or what the process knows that is sending to them. It disturbs no run."""
        if self._radio is None and (told := self._told()) is not None:
            return told
        try:
            radio = self.radio
        except InUse as error:
            if (told := self._told()) is not None:
                return told
            raise self._by_whom(error) from None
        return DisplayStatus(self.spec, self.drive, read_status(radio, self.drive, self.named), known_rod(radio))

    def scan(self, *, tests_chips: bool = False) -> ScanResult:
        """Who is on the air, without keys; `tests_chips` asks what can be told of the radio chips instead."""
        self.close()
        return scan_display(self.spec, self.drive, self.folder, tests_chips=tests_chips)

    def channels(self, seconds: float = 120.0) -> ChannelScan:
        """For what part of the time others send on each channel, which is listened to for so long; nothing is sent."""
        from curveline.driving.air import scan_channels

        self.close()
        return scan_channels(self.spec, (self.drive, self.named), self.folder, seconds)

    def range(self, number: int, seconds: float = 60.0, levels: Sequence[str] = ()) -> RangeTest:
        """How many polls of one node (from 1) are lost with each power of the radio, or with some; nothing moves.

        Powers are "min", "low", "high" and "max", which is what runs are sent with.
        """
        from curveline.driving.air import range_of
        from curveline.radio.measuring.reach import RangeWish

        self.close()
        return range_of(self.spec, (self.drive, self.named), self.folder, number, RangeWish(seconds, tuple(levels)))

    def find_devices(self, *numbers: int) -> Adoption:
        """Which devices are the nodes, or those with some `numbers`; `record` of it writes them into the key file.

        From then on only these are obeyed and believed: do it with nobody else's display switched on. Raises
        InvalidInput without a key file, LinkError unless exactly one fitting device answers on each address.
        """
        from curveline.driving.adoption import AdoptionPlace, find_devices
        from curveline.driving.site_keys import read_keys

        self.close()
        place = AdoptionPlace(self.spec, self.drive, self.folder, self.listener)
        return find_devices(place, read_keys(listener=self.listener), numbers)

    def plan(self, *shapes: object, home: bool = False, touched: bool = False) -> Plan:
        """A plan from where the display stands and what it shows, through shapes (paths or scenes), and then home.

        `touched` takes for granted that somebody touched the rod, so that nothing is known of its states. Raises
        Infeasible where no safe plan exists, and as `curveline.plan`.
        """
        wish = wish_of(shapes, home=home, display=self.named)
        return wish if isinstance(wish, Plan) else self._plan(wish, touched=touched)

    @contextmanager
    def prepared(self, wish: Wish, *, touched: bool = False) -> Iterator[PreparedRun]:
        """What is wished, planned and checked against the nodes, ready to be sent; nothing has moved.

        A wish is a plan, a tour of shapes, or a run that goes on, whose record stays locked in the context.
        """
        if isinstance(wish, InterruptedRun):
            # As it was while the run rested: what is in the midst of a step goes to its end first.
            self.check_rest(wish.plan, wish.point.barrier)
            with wish.opened() as journal:
                outlet = self.outlet
                self.listener.note(wish.summary())
                if not wish.point.released:
                    self._check_granted(wish.plan, self._statuses(wish.plan))
                yield PreparedRun(wish.plan, outlet, wish, journal)
            return
        yield PreparedRun(self.checked(wish, touched=touched), self.outlet)

    def checked(self, wish: Plan | Tour, *, touched: bool = False) -> Plan:
        """The plan that is wished, or one through the shapes that are, checked against nodes and rod."""
        if isinstance(wish, Tour):
            plan = self._plan(wish, touched=touched)
        else:
            plan = wish
            check_ready(plan, statuses := self._statuses(plan))
            self._check_granted(plan, statuses)
            check_for_rod(plan, self.outlet.record, self.listener)
        check_targets(plan)
        self.listener.note(f"{plan.name}: {summary(plan)}")
        return plan

    def check_rest(self, plan: Plan, done: int) -> None:
        """Infeasible for what is left of a plan, so many steps of which are done, if it is not safe for the rod now."""
        check_for_rod(rest_of(plan, done), self._record, self.listener)

    def send(
        self, *what: object, home: bool = False, touched: bool = False, control: Control | None = None
    ) -> RunResult:
        """Send a plan, or plan and send shapes (paths or scenes), and then go home if that is wished.

        `control` can pause, hold or stop the run from another thread or a signal handler. Raises LinkError once all
        nodes that can be held are held.
        """
        with self.prepared(wish_of(what, home=home, display=self.named), touched=touched) as run:
            return run.send(control)

    def dry_run(self, *what: object, home: bool = False, touched: bool = False) -> DryRun:
        """What `send` would stage, as the nodes would decode it; no radio is opened, nothing moves or is remembered.

        Shapes are planned from where a mock display stands, and from home for any other radio. Raises InvalidInput if
        no node would take it, and as `plan`.
        """
        wish = wish_of(what, home=home, display=self.named)
        return dry_run_of(wish, DrySite(self.spec, self.folder, touched, self.listener))

    def resume(self, run: AnyPath = "last", control: Control | None = None) -> RunResult:
        """Go on with a run that was broken off, by its folder, its name, or the newest that can; else as `send`."""
        with self.prepared(run_to_resume(os.fspath(run), self.drive.display, self.folder, self.listener)) as prepared:
            return prepared.send(control)

    def home(self, control: Control | None = None) -> RunResult:
        """Bring the display home: nodes level and upright, the rod straight; else as `send`."""
        return self.send(home=True, control=control)

    def stop(self) -> Halting:
        """Bring every node to a hold, whoever drives it; a run of another process of this computer is paused."""
        self.close()
        return stop_display(self.spec, self.drive, self.folder)

    def node(self, number: int) -> OneNode:
        """One node, by its number in the row from 1: what it says of itself, and what brings it back to work."""
        expect(number, int, "the number of a node")
        refuse_while_sending(self.drive, self.named, self.spec, self.folder)
        return OneNode(number, self.named, self.spec, self.drive, self._radio_to(number))

    def _radio_to(self, number: int) -> Radio:
        """The radio, opened for one node; whether the others were adopted is no matter."""
        with lenient():
            radio = self._opened()
        if 0 < number <= self.drive.node_count and radio.site.chips[number - 1] == UNKNOWN_CHIP:
            self.close()
            raise unadopted(self.drive, [self.drive.addresses[number - 1]])
        return radio

    def new_settings(self, nodes: Sequence[int] = (), was: Formerly | None = None) -> SettingsChange:
        """What nodes (all if none are named) are to get over the air, to be what the display file and key file say.

        `was` says where they listen now, if that is not where the display file says. Look at the `nodes` of what comes
        back, then `carry_out`, and `close` it. Raises LinkError for a node that is not found or cannot be changed.
        """
        from curveline.driving.new_settings import Formerly, settings_change
        from curveline.driving.tuning import RadioTuner

        self.close()
        refuse_while_sending(self.drive, self.named, self.spec, self.folder)
        tuner = RadioTuner(self.spec, self.drive, self.folder)
        try:
            change = settings_change(tuner, self.drive, nodes, was or Formerly(), self.named)
            change.survey()
        except BaseException:
            tuner.close()
            raise
        return change

    def stray_channel(self, number: int) -> int | None:
        """The channel on which a node answers that does not on the display's; None if it does on none."""
        from curveline.driving.stray import stray_channel

        self.close()
        return stray_channel(self.spec, self.drive, self.folder, number)

    def rod(self) -> RodNow:
        """What the rod of this display went through by the runs on record, and what set that left in it now.

        If the display file does not say what set its rod takes, that is acetal's, an estimate.
        """
        from curveline.driving.rod_now import rod_now
        from curveline.shapes.files import given_display

        return rod_now(given_display(self.named), RodRecord(self.spec, self.folder, self._since), time.time())

    def new_rod(self) -> None:
        """Put down that a new rod is in this display from now on; else as `rod`."""
        from curveline.driving.rod_now import begin_new_rod
        from curveline.shapes.files import given_display

        begin_new_rod(given_display(self.named), RodRecord(self.spec, self.folder), time.time())

    def runs(self) -> Iterator[Run]:
        """The runs of this display on record, the newest first."""
        from curveline.driving.runs import read_runs

        return read_runs(self.folder, self.drive.display)

    @property
    def _record(self) -> RodRecord:
        """Where the runs of the rod are on record; no radio is opened for that."""
        return RodRecord(self.spec, self.folder, self._since)

    @property
    def outlet(self) -> Outlet:
        """Through what is sent."""
        return Outlet(self.radio, self.spec, self.folder, self.listener, self._since)

    def _told(self) -> DisplayStatus | None:
        """What a process of this computer knows that is sending to these nodes."""
        sender = news_of(self.drive, self.spec, self.folder)
        return None if sender is None else DisplayStatus(self.spec, self.drive, sender.live.statuses, sender=sender)

    def _by_whom(self, error: InUse) -> InUse:
        """Why the radio is in use, with who sends to another display over it, if that is known."""
        others = [each for each in senders(self.folder) if same_radio(each.live.radio, self.spec)]
        who = f": {others[0].name}" if others and not self.spec.startswith("mock") else ""
        return InUse(error.message + who, error.hint)

    def _plan(self, tour: Tour, *, touched: bool) -> Plan:
        """A plan from where the nodes say that they stand; LinkError if one of them cannot say."""
        radio, named = self.radio, tour.display.path or tour.display.name
        statuses = read_status(radio, self.drive, named)
        check_movable(statuses)
        counts = []
        for status in statuses:
            if status.counts is None:
                hint = f"see `curveline status{display_option(named)}`"
                raise LinkError(f"node {status.node} does not answer", hint, status.node)
            counts.append(status.counts)
        shown = Shown() if touched else shown_states(radio, self.drive, statuses, self.folder)
        if shown.states or any(any(each) for each in counts):
            self.listener.note(shown.line())
        tour = with_rod_now(tour, self.outlet.record, self.listener)
        return plan_tour(tour, Whereabouts(tuple(counts), shown.states), self.listener)

    def _statuses(self, plan: Plan) -> list[NodeStatus]:
        """What the nodes of a plan say now."""
        return read_status(self.radio, plan.drive, named_display(plan))

    def _check_granted(self, plan: Plan, statuses: Sequence[NodeStatus]) -> None:
        """Tell what is known of the states that a plan begins in; Infeasible if the display shows others."""
        if known := check_granted(plan, self.radio, statuses, self.folder):
            self.listener.note(known)
