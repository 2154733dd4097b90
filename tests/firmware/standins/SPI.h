/* Stands in for Teensyduino's header of that name; how it was checked is said in Arduino.h. */
#ifndef STANDIN_SPI_H
#define STANDIN_SPI_H

#include <stdint.h>

#define SPI_MODE0 0

struct SPISettings {
    SPISettings(uint32_t clock_hz, uint8_t order, uint8_t mode);
};

struct StandinSpi {
    void begin();
    void beginTransaction(SPISettings settings);
    uint8_t transfer(uint8_t byte);
    void endTransaction();
};
extern StandinSpi SPI;

#endif
