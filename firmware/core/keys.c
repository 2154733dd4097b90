#include "keys.h"

#include <string.h>

#include "bytes.h"

enum { BODY_BYTES = 24, NONCE_BYTES = 8 };

static void derive(cl_key *key, const cl_key *from, const uint8_t *message, size_t length) {
    cl_blake2s((cl_bytes){from->bytes, CL_KEY_BYTES}, (cl_bytes){message, length}, key->bytes, CL_KEY_BYTES);
}

void cl_node_key(cl_key *key, const cl_key *master, uint32_t chip) {
    uint8_t message[8] = {'n', 'o', 'd', 'e'};
    cl_put32(message + 4, chip);
    derive(key, master, message, sizeof message);
}

void cl_stop_key(cl_key *key, const cl_key *master) {
    static const uint8_t message[4] = {'s', 't', 'o', 'p'};
    derive(key, master, message, sizeof message);
}

uint16_t cl_session_number(const cl_node_nonce *nonce) { return (uint16_t)((nonce->offers - 1) % UINT16_MAX + 1); }

void cl_session_key(cl_key *key, const cl_key *node_key, const cl_handshake *handshake) {
    uint8_t message[7 + 8 + 3 * 4 + 8] = {'s', 'e', 's', 's', 'i', 'o', 'n'};
    cl_put64(message + 7, handshake->host_nonce);
    cl_put32(message + 15, handshake->node_nonce.boot);
    cl_put32(message + 19, handshake->node_nonce.offers);
    cl_put32(message + 23, handshake->node_nonce.noise);
    cl_put64(message + 27, handshake->run_tag);
    derive(key, node_key, message, sizeof message);
}

void cl_open_key(cl_key *key) {
    static const cl_key zeros = {{0}};
    static const uint8_t message[4] = {'p', 'a', 'g', 'e'};
    derive(key, &zeros, message, sizeof message);
}

void cl_settings_stream(uint8_t stream[CL_KEY_BYTES], const cl_key *session_key, uint32_t counter) {
    cl_key found;
    uint8_t message[8 + 4] = {'s', 'e', 't', 't', 'i', 'n', 'g', 's'};
    cl_put32(message + 8, counter);
    derive(&found, session_key, message, sizeof message);
    memcpy(stream, found.bytes, CL_KEY_BYTES);
}

void cl_tag_key(cl_keyed *keyed, const cl_key *key) {
    cl_blake2s_key(keyed, (cl_bytes){key->bytes, CL_KEY_BYTES}, CL_TAG_BYTES);
}

void cl_tag(const cl_keyed *keyed, const uint8_t *body, uint64_t nonce, char direction, uint8_t tag[CL_TAG_BYTES]) {
    uint8_t covered[BODY_BYTES + NONCE_BYTES + 1];
    size_t length = BODY_BYTES;
    memcpy(covered, body, BODY_BYTES);
    if (nonce != 0) {
        cl_put64(covered + length, nonce);
        length += NONCE_BYTES;
    }
    covered[length++] = (uint8_t)direction;
    cl_blake2s_keyed(keyed, (cl_bytes){covered, length}, tag, CL_TAG_BYTES);
}
