/* An nRF24L01+ as receiver with one answer loaded: register by register, after the product specification 1.0. */
#ifndef NRF24_H
#define NRF24_H

#include <stdbool.h>
#include <stdint.h>

#include "settings_record.h"

#define NRF24_PAYLOAD_BYTES 32u

void nrf24_pins(void);

/* Write all settings and listen; false if the chip does not hold them, as when there is none. */
bool nrf24_start(const cl_listening *settings);

/* Whether the chip still holds all settings: it forgets them in a dip of its supply. */
bool nrf24_intact(const cl_listening *settings);

/* Whether the request line says that something came in. */
bool nrf24_calls(void);

/* Take the oldest packet: its length, 0 if there is none. */
uint8_t nrf24_receive(uint8_t payload[NRF24_PAYLOAD_BYTES]);

/* Replace the loaded answer; none if `length` is 0. */
void nrf24_load(const uint8_t *payload, uint8_t length);

/* How long the radio takes to acknowledge with a full payload, from the moment a packet came in [us]. */
uint32_t nrf24_answer_us(const cl_listening *settings);

#endif
