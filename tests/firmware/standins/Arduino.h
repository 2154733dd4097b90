/* Stands in for Teensyduino's header of that name, so that a sketch can be compiled without it: names and types only. */
#ifndef STANDIN_ARDUINO_H
#define STANDIN_ARDUINO_H

#include <stddef.h>
#include <stdint.h>

#define LOW 0
#define HIGH 1
#define OUTPUT 1
#define MSBFIRST 1
#define KINETISL

extern volatile uint32_t SIM_UIDL, SIM_UIDML, SIM_UIDMH;

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
