/* The USB dongle: packets from the host in, radio frames out, results back. See docs/dongle-protocol.md.
 *
 * Portable: the radio and the line to the host are function pointers, time is what the caller says it is. A program
 * feeds whatever bytes have come, then calls cl_dongle_step in a loop; each step transmits one frame at most, so that
 * a new request is never kept waiting by an old one for longer than that. */
#ifndef CL_DONGLE_H
#define CL_DONGLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define CL_DONGLE_VERSION 1u
#define CL_DONGLE_FIRMWARE 0x00010100u /* major, minor, patch */
#define CL_DONGLE_FRAMES 16u
#define CL_DONGLE_ADDRESS 5u
#define CL_DONGLE_PAYLOAD 32u
#define CL_DONGLE_UNIQUE 16u
#define CL_DONGLE_CHANNELS 126u
#define CL_DONGLE_FULL_POWER 3u
#define CL_DONGLE_FRAME (CL_DONGLE_ADDRESS + CL_DONGLE_PAYLOAD)
#define CL_DONGLE_BODY (3u + CL_DONGLE_FRAMES * CL_DONGLE_FRAME) /* the longest request, without its checksum */
#define CL_DONGLE_ANSWER 38u                                     /* the longest answer, without its checksum */
#define CL_DONGLE_LIMIT_MS 1000u                                 /* no schedule goes on for longer */

/* What a host may ask, and what it is told: byte 0 of a packet. */
enum {
    CL_DONGLE_HELLO = 0x01,
    CL_DONGLE_CONFIGURE = 0x02,
    CL_DONGLE_SCHEDULE = 0x03,
    CL_DONGLE_SCAN = 0x04,
    CL_DONGLE_IDENT = 0x81,
    CL_DONGLE_CONFIGURED = 0x82,
    CL_DONGLE_RESULT = 0x83,
    CL_DONGLE_SCANNED = 0x84,
    CL_DONGLE_REFUSED = 0xFF
};

/* Why a request was refused. */
enum { CL_DONGLE_UNKNOWN = 1, CL_DONGLE_MALFORMED = 2, CL_DONGLE_UNCONFIGURED = 3, CL_DONGLE_CHIP = 4 };

/* What IDENT says the dongle can do beyond schedules. */
enum { CL_DONGLE_CAN_SCAN = 1, CL_DONGLE_CAN_SET_POWER = 2 };

/* Settings of the radio: rate 0 is 250 kbps, 1 is 1 Mbps, 2 is 2 Mbps; power 0 to 3 is -18, -12, -6, 0 dBm. */
typedef struct {
    uint8_t channel;
    uint8_t rate;
    uint8_t width;
    uint8_t retries;
    uint16_t delay_us;
    uint8_t power;
} cl_dongle_settings;

/* What one transmission came to. */
typedef enum {
    CL_DONGLE_NOTHING = 0, /* nobody acknowledged */
    CL_DONGLE_ACKED = 1,   /* acknowledged, with a payload if the length is not 0 */
    CL_DONGLE_BROKEN = 2   /* the chip itself does not answer */
} cl_dongle_outcome;

/* What came with it. */
typedef struct {
    uint8_t payload[CL_DONGLE_PAYLOAD];
    uint8_t length;
    uint8_t retries;
} cl_dongle_reply;

/* The radio; every call returns within a bounded time. `carrier` may leave the chip on another channel. */
typedef struct {
    void *self;
    bool (*configure)(void *self, const cl_dongle_settings *settings);
    cl_dongle_outcome (*transmit)(void *self, const uint8_t *address, const uint8_t *payload, cl_dongle_reply *reply);
    bool (*carrier)(void *self, uint8_t channel);
} cl_dongle_radio;

/* The line to the host; false if the host does not take the bytes, which ends what it had asked for. */
typedef struct {
    void *self;
    bool (*emit)(void *self, const uint8_t *bytes, size_t length);
} cl_dongle_line;

/* One dongle. Everything in it belongs to the core. */
typedef struct {
    cl_dongle_radio radio;
    cl_dongle_line line;
    uint8_t unique[CL_DONGLE_UNIQUE];
    cl_dongle_settings settings;
    bool configured;
    bool astray; /* a scan has left the chip on another channel */
    uint16_t bad_packets;

    uint8_t inbox[CL_DONGLE_BODY + 4u]; /* the packet that is arriving */
    size_t filled;
    uint8_t left;   /* bytes until the next code byte */
    bool owes_zero; /* a zero stands before the next code byte, unless the packet ends there */
    bool begun, spoilt;

    uint8_t task; /* the request that is being worked off, 0 for none */
    uint8_t id, next, count;
    bool timed;
    uint32_t began_ms;
    uint8_t frames[CL_DONGLE_FRAMES * CL_DONGLE_FRAME];
    uint8_t carriers[(CL_DONGLE_CHANNELS + 7u) / 8u];
} cl_dongle;

void cl_dongle_init(cl_dongle *dongle, const cl_dongle_radio *radio, const cl_dongle_line *line,
                    const uint8_t unique[CL_DONGLE_UNIQUE]);

/* Take bytes from the host, in pieces of any size. */
void cl_dongle_feed(cl_dongle *dongle, const uint8_t *bytes, size_t length);

/* Do the next piece of what the host has asked for; true while there is more. */
bool cl_dongle_step(cl_dongle *dongle, uint32_t now_ms);

/* The host has gone: forget what it had asked for and what it was saying. */
void cl_dongle_abandon(cl_dongle *dongle);

/* CRC-32 as in zlib. */
uint32_t cl_dongle_crc(const uint8_t *bytes, size_t length);

#endif
