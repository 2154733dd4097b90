/* What makes random sequences: starts in starts.c, events in generate.c. */
#ifndef MAKER_H
#define MAKER_H

#include "twin.h"

enum { REMEMBERED = 8 };

typedef struct {
    uint64_t random;
    const twin_start *start;
    twin it;
    uint8_t sent[REMEMBERED][CL_FRAME_BYTES];
    unsigned sent_count;
    uint64_t handshake;
    cl_key secret;        /* of the session that the last frame belongs to */
    cl_keyed session_key; /* of the session that the last frame belongs to */
    int64_t now_ms;       /* of the event that is being made */
    uint64_t clock;       /* that the last frame was made with, 0 for none */
} maker;

/* Numbers that look random; the same for the same seed everywhere. */
uint64_t draw(maker *make);
uint32_t below(maker *make, uint32_t end);
bool chance(maker *make, uint32_t percent);
int32_t between(maker *make, int32_t low, int32_t high);

uint64_t run_tag(maker *make);

/* A place for the axes: near `near` mostly, so that moves are short; sometimes at or beyond a limit. */
void place(maker *make, const int32_t near[CL_AXES], int32_t at[CL_AXES]);

/* Why an axis is not homed, if it is not. */
uint8_t random_reason(maker *make);

void random_start(maker *make, twin_start *start);

#endif
