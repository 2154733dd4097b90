/* See dongle.h, and docs/dongle-protocol.md for the bytes. */
#include "dongle.h"

#include "bytes.h"

enum { CRC_BYTES = 4, HEAD_BYTES = 2, CODE_MAX = 0xFF };

uint32_t cl_dongle_crc(const uint8_t *bytes, size_t length) {
    /* Four bits at a time: a table of 64 bytes, and 0.2 ms for the longest packet on a Cortex-M0+. */
    static const uint32_t table[16] = {0x00000000u, 0x1DB71064u, 0x3B6E20C8u, 0x26D930ACu, 0x76DC4190u, 0x6B6B51F4u,
                                       0x4DB26158u, 0x5005713Cu, 0xEDB88320u, 0xF00F9344u, 0xD6D6A3E8u, 0xCB61B38Cu,
                                       0x9B64C2B0u, 0x86D3D2D4u, 0xA00AE278u, 0xBDBDF21Cu};
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t index = 0; index < length; index++) {
        crc ^= bytes[index];
        crc = crc >> 4 ^ table[crc & 15u];
        crc = crc >> 4 ^ table[crc & 15u];
    }
    return ~crc;
}

/* No string.h: a freestanding compiler has none. */
static void copy(uint8_t *to, const uint8_t *from, size_t length) {
    for (size_t index = 0; index < length; index++)
        to[index] = from[index];
}

static void clear(uint8_t *bytes, size_t length) {
    for (size_t index = 0; index < length; index++)
        bytes[index] = 0;
}

/* Answers */

/* Send `body`, which has room for its checksum behind it, stuffed so that it holds no zero. An answer is far shorter
 * than 254 bytes, so the only code bytes are those that stand for a zero. */
static bool say(cl_dongle *dongle, uint8_t *body, size_t length) {
    uint8_t packet[CL_DONGLE_ANSWER + CRC_BYTES + 2];
    size_t code = 0, end = 1;
    cl_put32(body + length, cl_dongle_crc(body, length));
    for (size_t index = 0; index < length + CRC_BYTES; index++) {
        if (body[index] != 0) {
            packet[end++] = body[index];
        } else {
            packet[code] = (uint8_t)(end - code);
            code = end++;
        }
    }
    packet[code] = (uint8_t)(end - code);
    packet[end++] = 0;
    return dongle->line.emit(dongle->line.self, packet, end);
}

static void refuse(cl_dongle *dongle, uint8_t id, uint8_t request, uint8_t why) {
    uint8_t body[4 + CRC_BYTES] = {CL_DONGLE_REFUSED, id, request, why};
    (void)say(dongle, body, 4);
}

static void identify(cl_dongle *dongle, uint8_t id) {
    uint8_t body[CL_DONGLE_ANSWER + CRC_BYTES] = {CL_DONGLE_IDENT, id, CL_DONGLE_VERSION, dongle->configured};
    cl_put16(body + 4, CL_DONGLE_CAN_SCAN | CL_DONGLE_CAN_SET_POWER);
    cl_put32(body + 6, CL_DONGLE_FIRMWARE);
    body[10] = CL_DONGLE_FRAMES;
    cl_put16(body + 11, dongle->bad_packets);
    copy(body + 13, dongle->unique, CL_DONGLE_UNIQUE);
    (void)say(dongle, body, 13 + CL_DONGLE_UNIQUE);
}

/* Requests: each checks its own length; none looks into a payload */

static void on_configure(cl_dongle *dongle, const uint8_t *body, size_t length) {
    cl_dongle_settings settings;
    if (length != 8 && length != 9) {
        refuse(dongle, body[1], body[0], CL_DONGLE_MALFORMED);
        return;
    }
    settings.channel = body[2];
    settings.rate = body[3];
    settings.width = body[4];
    settings.retries = body[5];
    settings.delay_us = cl_get16(body + 6);
    settings.power = length == 9 ? body[8] : CL_DONGLE_FULL_POWER; /* hosts before 1.1 say none */
    bool fits = settings.channel < CL_DONGLE_CHANNELS && settings.rate <= 2 && settings.width >= 3 &&
                settings.width <= CL_DONGLE_ADDRESS && settings.retries <= 15 && settings.delay_us >= 250 &&
                settings.delay_us <= 4000 && settings.power <= CL_DONGLE_FULL_POWER;
    if (!fits) {
        refuse(dongle, body[1], body[0], CL_DONGLE_MALFORMED);
        return;
    }
    dongle->settings = settings;
    dongle->astray = false;
    dongle->configured = dongle->radio.configure(dongle->radio.self, &settings);
    if (!dongle->configured) {
        refuse(dongle, body[1], body[0], CL_DONGLE_CHIP);
        return;
    }
    uint8_t answer[2 + CRC_BYTES] = {CL_DONGLE_CONFIGURED, body[1]};
    (void)say(dongle, answer, 2);
}

/* Back to the channel of the display after a scan, whether that came to its end or not. */
static void come_home(cl_dongle *dongle) {
    if (dongle->astray && dongle->configured)
        dongle->configured = dongle->radio.configure(dongle->radio.self, &dongle->settings);
    dongle->astray = false;
}

static void on_schedule(cl_dongle *dongle, const uint8_t *body, size_t length) {
    come_home(dongle);
    uint8_t count = length > HEAD_BYTES ? body[HEAD_BYTES] : 0;
    if (count == 0 || count > CL_DONGLE_FRAMES || length != 3u + count * CL_DONGLE_FRAME) {
        refuse(dongle, body[1], body[0], CL_DONGLE_MALFORMED);
    } else if (!dongle->configured) {
        refuse(dongle, body[1], body[0], CL_DONGLE_UNCONFIGURED);
    } else {
        copy(dongle->frames, body + 3, count * CL_DONGLE_FRAME);
        dongle->task = CL_DONGLE_SCHEDULE;
        dongle->count = count;
    }
}

static void on_scan(cl_dongle *dongle, const uint8_t *body, size_t length) {
    if (length != HEAD_BYTES) {
        refuse(dongle, body[1], body[0], CL_DONGLE_MALFORMED);
        return;
    }
    clear(dongle->carriers, sizeof dongle->carriers);
    dongle->task = CL_DONGLE_SCAN;
    dongle->count = CL_DONGLE_CHANNELS;
}

/* A request that arrived whole. It ends the one before: a host asks one thing at a time, and one that asks anew has
 * given the old one up. */
static void obey(cl_dongle *dongle, const uint8_t *body, size_t length) {
    dongle->task = 0;
    dongle->timed = false;
    dongle->id = body[1];
    dongle->next = 0;
    if (body[0] == CL_DONGLE_HELLO)
        identify(dongle, body[1]); /* whatever follows the id: a later host may say more, and must learn our version */
    else if (body[0] == CL_DONGLE_CONFIGURE)
        on_configure(dongle, body, length);
    else if (body[0] == CL_DONGLE_SCHEDULE)
        on_schedule(dongle, body, length);
    else if (body[0] == CL_DONGLE_SCAN)
        on_scan(dongle, body, length);
    else
        refuse(dongle, body[1], body[0], CL_DONGLE_UNKNOWN);
}

/* Packets */

static void expect_packet(cl_dongle *dongle) {
    dongle->filled = 0;
    dongle->left = 0;
    dongle->owes_zero = false;
    dongle->begun = false;
    dongle->spoilt = false;
}

/* A zero has come, which stands between packets and nowhere else: from here on anything is understood again. */
static void end_packet(cl_dongle *dongle) {
    bool begun = dongle->begun;
    bool whole = !dongle->spoilt && dongle->left == 0 && dongle->filled >= HEAD_BYTES + CRC_BYTES;
    size_t length = whole ? dongle->filled - CRC_BYTES : 0;
    expect_packet(dongle);
    if (whole && cl_get32(dongle->inbox + length) == cl_dongle_crc(dongle->inbox, length))
        obey(dongle, dongle->inbox, length);
    else if (begun && dongle->bad_packets < UINT16_MAX)
        dongle->bad_packets++;
}

static void keep(cl_dongle *dongle, uint8_t byte) {
    if (dongle->filled < sizeof dongle->inbox)
        dongle->inbox[dongle->filled++] = byte;
    else
        dongle->spoilt = true;
}

static void take(cl_dongle *dongle, uint8_t byte) {
    dongle->begun = true;
    if (dongle->left > 0) {
        dongle->left--;
        keep(dongle, byte);
        return;
    }
    if (dongle->owes_zero)
        keep(dongle, 0);
    dongle->owes_zero = byte != CODE_MAX;
    dongle->left = (uint8_t)(byte - 1u);
}

void cl_dongle_feed(cl_dongle *dongle, const uint8_t *bytes, size_t length) {
    for (size_t index = 0; index < length; index++) {
        if (bytes[index] == 0)
            end_packet(dongle);
        else
            take(dongle, bytes[index]);
    }
}

/* Work */

static bool transmit_next(cl_dongle *dongle) {
    const uint8_t *frame = dongle->frames + dongle->next * CL_DONGLE_FRAME;
    cl_dongle_reply reply = {.length = 0, .retries = 0};
    cl_dongle_outcome outcome =
        dongle->radio.transmit(dongle->radio.self, frame, frame + CL_DONGLE_ADDRESS, &reply);
    uint8_t length = outcome == CL_DONGLE_ACKED && reply.length <= CL_DONGLE_PAYLOAD ? reply.length : 0;
    uint8_t body[CL_DONGLE_ANSWER + CRC_BYTES] = {CL_DONGLE_RESULT, dongle->id,    dongle->next,
                                                  (uint8_t)outcome, reply.retries, length};
    copy(body + 6, reply.payload, length);
    return say(dongle, body, 6u + length);
}

static bool sense_next(cl_dongle *dongle) {
    dongle->astray = true;
    if (dongle->radio.carrier(dongle->radio.self, dongle->next))
        dongle->carriers[dongle->next / 8u] |= (uint8_t)(1u << dongle->next % 8u);
    if (dongle->next + 1u < dongle->count)
        return true;
    uint8_t body[CL_DONGLE_ANSWER + CRC_BYTES] = {CL_DONGLE_SCANNED, dongle->id};
    copy(body + HEAD_BYTES, dongle->carriers, sizeof dongle->carriers);
    return say(dongle, body, HEAD_BYTES + sizeof dongle->carriers);
}

bool cl_dongle_step(cl_dongle *dongle, uint32_t now_ms) {
    if (dongle->task == 0)
        return false;
    if (!dongle->timed) {
        dongle->timed = true;
        dongle->began_ms = now_ms;
    }
    bool taken = now_ms - dongle->began_ms <= CL_DONGLE_LIMIT_MS;
    if (taken)
        taken = dongle->task == CL_DONGLE_SCHEDULE ? transmit_next(dongle) : sense_next(dongle);
    dongle->next++;
    if (!taken || dongle->next >= dongle->count)
        dongle->task = 0; /* a host that takes no answers is not there: nothing is sent on its behalf */
    return dongle->task != 0;
}

void cl_dongle_abandon(cl_dongle *dongle) {
    dongle->task = 0;
    expect_packet(dongle);
}

void cl_dongle_init(cl_dongle *dongle, const cl_dongle_radio *radio, const cl_dongle_line *line,
                    const uint8_t unique[CL_DONGLE_UNIQUE]) {
    *dongle = (cl_dongle){.configured = false};
    dongle->radio = *radio;
    dongle->line = *line;
    copy(dongle->unique, unique, CL_DONGLE_UNIQUE);
    expect_packet(dongle);
}
