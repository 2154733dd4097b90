"""What phases of a run have in common."""

from __future__ import annotations

from curveline.radio.host.actions import Phase

ENDED = frozenset({Phase.DONE, Phase.HALTED})
STOPPING = frozenset({Phase.PAUSING, Phase.HALTING})
GOING = frozenset({Phase.STAGING, Phase.RELEASED})
UNCLAIMED = frozenset({Phase.DISCOVER, Phase.PREFLIGHT})
WATCHED = frozenset({Phase.STAGING, Phase.RELEASED, Phase.PAUSING, Phase.PAUSED})
