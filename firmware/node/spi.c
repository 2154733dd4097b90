/* SPI0 as master, mode 0, 6 MHz: the radio takes 10 at most and the bus offers 12 or 6. SPI_MHZ makes it slower, for long
 * wires to the radio. */
#include "spi.h"

#include "board.h"

#ifndef SPI_MHZ
#define SPI_MHZ 6
#endif

/* What the bus' 24 MHz are divided by: the upper half of the byte plus one, times two to the lower half plus one. */
#if SPI_MHZ == 6
#define SPI_RATE 0x01u
#elif SPI_MHZ == 3
#define SPI_RATE 0x02u
#elif SPI_MHZ == 1
#define SPI_RATE 0x22u
#else
#error "SPI_MHZ is 6, 3 or 1"
#endif

#define SPI_PATIENCE 200 /* loops; a byte takes 64 core cycles, or 384 at 1 MHz */

void spi_start(void) {
    PORT_PCR(CSN_PORT, CSN_PIN) = PCR_GPIO;
    spi_deselect();
    GPIO_PDDR(CSN_PORT) |= 1u << CSN_PIN;
    PORT_PCR(PORT_C, 5) = PCR_MUX(2);
    PORT_PCR(PORT_C, 6) = PCR_MUX(2);
    PORT_PCR(PORT_C, 7) = PCR_MUX(2);
    SPI0_C1 = 0;
    SPI0_C2 = 0;
    SPI0_BR = SPI_RATE;
    SPI0_C1 = SPI_C1_SPE | SPI_C1_MSTR;
}

void spi_select(void) { GPIO_PCOR(CSN_PORT) = 1u << CSN_PIN; }
void spi_deselect(void) { GPIO_PSOR(CSN_PORT) = 1u << CSN_PIN; }

/* A dead SPI block reads as 0xFF, as an absent radio does; the radio's settings check notices both. */
uint8_t spi_transfer(uint8_t out) {
    int patience = SPI_PATIENCE;
    while ((SPI0_S & SPI_S_SPTEF) == 0 && --patience > 0) {
    }
    SPI0_DL = out;
    while ((SPI0_S & SPI_S_SPRF) == 0 && --patience > 0) {
    }
    return patience > 0 ? SPI0_DL : 0xFFu;
}
