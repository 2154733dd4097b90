/* Stands in for Teensyduino's header of that name, so that a sketch can be compiled without it: names and types only.
 *
 * No package index has the vendor's headers: neither PyPI nor npm nor Debian (looked for in November 2026; a crate and a
 * conda channel carry old ones). What stands here was held against them by firmware/dongle/expects.cpp, which has to pass
 * with both: with the cores of 27 June 2026 and the SPI library of 1 December 2023, as of then the newest, for a Teensy LC,
 * 3.2 and 4.0, built and linked by `make -C firmware dongle` with GCC 12.2. */
#ifndef STANDIN_ARDUINO_H
#define STANDIN_ARDUINO_H

#include <stddef.h>
#include <stdint.h>

#define LOW 0
#define HIGH 1
#define OUTPUT 1
#define MSBFIRST 1
#define KINETISL

extern const uint32_t SIM_UIDL, SIM_UIDML, SIM_UIDMH;

extern "C" {
void pinMode(uint8_t pin, uint8_t mode);
void digitalWrite(uint8_t pin, uint8_t level);
void delayMicroseconds(uint32_t duration_us);
uint32_t micros(void);
uint32_t millis(void);
}

struct StandinSerial {
    void begin(long baud);
    int available();
    int read();
    size_t write(const uint8_t *bytes, size_t length);
    void send_now();
    uint8_t dtr();
};
extern StandinSerial Serial;

#endif
