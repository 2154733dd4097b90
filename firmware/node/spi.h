#ifndef SPI_H
#define SPI_H

#include <stdint.h>

void spi_start(void);
void spi_select(void);
void spi_deselect(void);
uint8_t spi_transfer(uint8_t out);

#endif
