/* Three quadrature encoders on one port: one interrupt, one read, one table. */
#include "encoder.h"

#include "board.h"
#include "program.h"

#define ILLEGAL 2

/* Way between two readings of channels A and B, old reading in the upper two bits. Both channels at once means that an
 * edge was missed: which way it went is unknown. */
static const int8_t steps[16] = {
    0, 1, -1, ILLEGAL,
    -1, 0, ILLEGAL, 1,
    1, ILLEGAL, 0, -1,
    ILLEGAL, -1, 1, 0,
};

static volatile int32_t counts[3];
static volatile uint32_t illegal[3];
static uint32_t before;

void encoder_start(void) {
    for (unsigned pin = 0; pin < 6; pin++) {
        PORT_PCR(ENCODER_PORT, pin) = PCR_GPIO | PCR_PULL_UP | PCR_IRQ_EITHER;
    }
    before = GPIO_PDIR(ENCODER_PORT) & ENCODER_PINS;
    PORT_ISFR(ENCODER_PORT) = ENCODER_PINS;
}

/* Ports C and D share this interrupt: encoder edges, and the radio's request, which only has to wake the main loop. It
 * comes before the tick, because an edge that waits too long meets the next one and is lost. */
void pins_handler(void) {
    PORT_ISFR(RADIO_IRQ_PORT) = 1u << RADIO_IRQ_PIN;
    PORT_ISFR(ENCODER_PORT) = ENCODER_PINS; /* before the read: an edge after it asks again */
    uint32_t now = GPIO_PDIR(ENCODER_PORT) & ENCODER_PINS;
    uint32_t changed = now ^ before;
    for (unsigned axis = 0; changed != 0; axis++, changed >>= 2) {
        if ((changed & 3u) == 0) {
            continue;
        }
        unsigned shift = 2 * axis;
        int step = steps[(before >> shift & 3u) << 2 | (now >> shift & 3u)];
        if (step == ILLEGAL) {
            illegal[axis]++;
        } else {
            counts[axis] += step;
        }
    }
    before = now;
}

/* Each count is read in one go; the three may be an edge apart, which is true of the motors, too. */
void encoder_read(cl_counts *now) {
    for (unsigned axis = 0; axis < 3; axis++) {
        now->at[axis] = counts[axis];
    }
}

/* Interrupts wait for these few instructions: an edge between load and store would be lost. */
void encoder_shift(const cl_counts *shift) {
    cpu_mask_interrupts();
    for (unsigned axis = 0; axis < 3; axis++) {
        counts[axis] += shift->at[axis];
    }
    cpu_allow_interrupts();
}

uint32_t encoder_illegal(unsigned axis) { return illegal[axis]; }
