/* Keys of the link protocol, docs/radio-protocol.md: master key -> node key -> session key, and the tags of frames. */
#ifndef CL_KEYS_H
#define CL_KEYS_H

#include <stdint.h>

#include "blake2s.h"

#define CL_KEY_BYTES 16
#define CL_TAG_BYTES 8
#define CL_FROM_HOST 'H'
#define CL_FROM_NODE 'N'

typedef struct {
    uint8_t bytes[CL_KEY_BYTES];
} cl_key;

/* What a node puts into a session key: its boot, the offers it has made since, and noise taken at boot. */
typedef struct {
    uint32_t boot, offers, noise;
} cl_node_nonce;

/* Number by which frames name the session that is offered; never 0. */
uint16_t cl_session_number(const cl_node_nonce *nonce);

/* What a session key is made of besides the node key: fresh on both sides, and bound to the run. */
typedef struct {
    uint64_t host_nonce;
    cl_node_nonce node_nonce;
    uint64_t run_tag;
} cl_handshake;

void cl_node_key(cl_key *key, const cl_key *master, uint32_t chip);
void cl_stop_key(cl_key *key, const cl_key *master);
void cl_session_key(cl_key *key, const cl_key *node_key, const cl_handshake *handshake);

/* The key of pages: everybody has it, so a tag under it is a checksum and no evidence. */
void cl_open_key(cl_key *key);

/* What hides the piece of settings that a frame carries: bytes that no other frame of the session has. */
void cl_settings_stream(uint8_t stream[CL_KEY_BYTES], const cl_key *session_key, uint32_t counter);

/* Make `keyed` ready for tags under `key`. */
void cl_tag_key(cl_keyed *keyed, const cl_key *key);

/* Tag of a frame's body. The direction is bound in, so that a frame cannot be reflected to its sender; so is `nonce`, the
   handshake that is answered or the whole time of which the frame carries the low bits, unless it is 0. */
void cl_tag(const cl_keyed *keyed, const uint8_t *body, uint64_t nonce, char direction, uint8_t tag[CL_TAG_BYTES]);

#endif
