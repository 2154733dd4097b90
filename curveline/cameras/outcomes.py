"""What can come of a photograph of a display, or of any other trial of one."""

from __future__ import annotations

from enum import StrEnum


class TrialOutcome(StrEnum):
    """What came of a trial: `SEEN` if its points can be used; else why not."""

    SEEN = "seen"
    NO_TAGS = "no-tags"
    TAGS_DISAGREE = "tags-disagree"
    BLURRED = "blurred"
    ROD_NOT_SEEN = "rod-not-seen"
    NOT_ELASTIC = "not-elastic"
    TOO_LITTLE_SEEN = "too-little-seen"
    AMBIGUOUS = "ambiguous"
    NO_STATE = "none-of-states"
