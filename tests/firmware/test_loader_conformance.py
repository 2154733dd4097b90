"""The loader in C and its Python specification do the same, whatever hosts, strangers and the power do to a node."""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path

import pytest

from .loader_twin import UPDATE, Differs, Life, library

LIVES = 150
CAMPAIGN = 20_000
ACTS = 60
ENOUGH_FOR_A_MISTAKE = 400
MUST_OCCUR = (
    *("hello", "query", "sector", "no sector", "started"),
    *("cut, as it was", "cut, done", "cut, less"),
    *("begin DONE", "begin REFUSED", "finish DONE", "finish REFUSED", "finish DIGEST", "leave DONE", "leave REFUSED"),
)
MISTAKES = (
    ("!= BLANK_WORD; }", "== 0; }"),
    ("length % 4 == 0 && ", ""),
    ("length >= LEAST_LENGTH && ", ""),
    (" && length <= PROGRAM_END - PROGRAM_BEGIN", ""),
    (" &&\n           words[WORD_SETTINGS] == SETTINGS_LAYOUT", ""),
    ("return sum == words[WORD_SUM] && ", "return "),
    ("return makes_sense(described()) && is_set(MARK_WHOLE)", "return makes_sense(described())"),
    ("return makes_sense(described()) && is_set(MARK_WHOLE)", "return is_set(MARK_WHOLE)"),
    ("is_set(MARK_WHOLE) && (is_set(MARK_KEPT) || !is_set(MARK_TRIED));\n}", "is_set(MARK_WHOLE);\n}"),
    ("return is_set(MARK_KEPT); }", "return is_set(MARK_TRIED); }"),
    ("return set(MARK_TRIED); }", "return true; }"),
    ("at * SECTOR_BYTES < words", "at * SECTOR_BYTES <= words"),
    ("    sector = wanted();\n    held = 0;", "    sector = wanted();"),
    ("    sector = wanted();\n    held = 0;", "    held = 0;"),
    ("unsigned i = DESCRIPTION_WORDS; i-- > 0 && good;", "unsigned i = DESCRIPTION_WORDS; --i > 0 && good;"),
    ("bool good = flash_erase(DESCRIPTION);", "bool good = true;"),
    ("    if (sector != SECTOR_NONE) {\n        return OUTCOME_DONE; /* said once more */\n    }\n", ""),
    ("held != DESCRIPTION_HELD || !makes", "!makes"),
    ("held != DESCRIPTION_HELD || !makes_sense(words)", "held != DESCRIPTION_HELD"),
    (" == 0 && (is_set(MARK_KEPT) || !is_set(MARK_TRIED));\n    bool", " == 0;\n    bool"),
    ("bool same = memcmp(words, described(), sizeof words) == 0 && ", "bool same = "),
    ("bool good = same || describe", "bool good = describe"),
    ("bool good = flash_erase(address);", "bool good = true;"),
    ("return good && set(sector);", "return good;"),
    ("i < SECTOR_WORDS && good", "i < SECTOR_WORDS - 1 && good"),
    ("{node_key.bytes, CL_KEY_BYTES}, program", "{node_key.bytes, 0}, program"),
    ("    if (wanted() != SECTOR_ALL) {\n        return OUTCOME_REFUSED;\n    }\n", ""),
    ("    if (is_set(MARK_WHOLE)) {\n        return OUTCOME_DONE;\n    }\n", ""),
    ("if (!is_as_described()) {", "if (false) {"),
    ("        flash_erase(DESCRIPTION);\n        look_again();", "        look_again();"),
    ("        flash_erase(DESCRIPTION);\n        look_again();", "        flash_erase(DESCRIPTION);"),
    ("return set(MARK_WHOLE) ? OUTCOME_DONE", "return is_set(0) ? OUTCOME_DONE"),
    ("place == PLACE_DESCRIPTION && sector != SECTOR_NONE", "place == PLACE_DESCRIPTION"),
    (" || piece >= PIECES", ""),
    ("if (place != sector || piece", "if (piece"),
    ("held == UINT64_MAX", "held >> 63"),
    ("        last = sector;\n", ""),
    ("over = update_runnable();", "over = true;"),
    ("        last = place;\n", ""),
    ("return wrong == 0;", "return true;"),
    ("    live = offered;\n    offered.number = 0;", "    live = offered;"),
    ("    outcome = OUTCOME_NONE;\n", ""),
    ("    last = PLACE_ASK;\n    look_again();", "    look_again();"),
    ("    last = PLACE_ASK;\n    look_again();", "    last = PLACE_ASK;"),
    ("    nonce.offers++;\n", ""),
    ("hello->run_tag});", "0});"),
    ("offered.counter = 0;", "offered.counter = 1;"),
    (" || hello.node != number", ""),
    ("(hello.flags & CL_FLAG_QUERY) != 0", "false"),
    ("hello.nonce & ~(uint64_t)CL_ATTEMPT_MASK", "hello.nonce"),
    ("offered.number != 0 && handshake == fresh", "false"),
    (".cause = reset_cause(),", ""),
    (".clock = cl_clock_of(now_ms),", ""),
    ("is_set(MARK_KEPT) << 2", "0"),
    ("cl_put64(update_answer + 8, held);", "cl_put32(update_answer + 8, (uint32_t)held);"),
    ("update_answer + 20, flash_word(DESCRIPTION)", "update_answer + 20, 0"),
    ("length != CL_FRAME_BYTES || ", ""),
    ("payload[0] >> 4 != CL_VERSION", "false"),
    (" & COUNTER_MASK;", ";"),
    ("if (counter > live.counter)", "if (counter >= live.counter)"),
    ("            live.counter = counter;\n", ""),
)
QUICKLY = ("-O0", "-g0", "-w")


def run_lives(c: ctypes.CDLL, first: int, count: int) -> dict[str, int]:
    """What has happened in some lives; Differs if the two do not agree."""
    seen: dict[str, int] = {}
    for seed in range(first, first + count):
        life = Life(c, seed)
        try:
            life.live(ACTS)
        except Differs as difference:
            raise Differs(f"life {seed}: {difference}") from None
        for what, times in life.seen.items():
            seen[what] = seen.get(what, 0) + times
    return seen


@pytest.mark.parametrize(("first", "lives"), [(0, LIVES), pytest.param(50_000, CAMPAIGN, marks=pytest.mark.campaign)])
def test_random_lives_come_out_the_same(tmp_path: Path, first: int, lives: int) -> None:
    seen = run_lives(library(tmp_path, UPDATE.read_text()), first, lives)
    sys.stdout.writelines(f"{count:9} {what}\n" for what, count in sorted(seen.items()))
    assert not [what for what in MUST_OCCUR if seen.get(what, 0) < lives // 20]


@pytest.mark.parametrize(
    ("right", "wrong"),
    [pytest.param(*each, marks=pytest.mark.campaign) if at % 2 else each for at, each in enumerate(MISTAKES)],
)
def test_a_mistake_in_the_c_loader_is_found(tmp_path: Path, right: str, wrong: str) -> None:
    text = UPDATE.read_text()
    assert text.count(right) == 1, "the mistake no longer fits the code"
    with pytest.raises(Differs):
        run_lives(library(tmp_path, text.replace(right, wrong), QUICKLY), 0, ENOUGH_FOR_A_MISTAKE)
