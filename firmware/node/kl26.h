/* Registers of the MKL26Z64 (Teensy LC) that this program touches, after NXP's reference manual KL26P121M48SF4RM. */
#ifndef KL26_H
#define KL26_H

#include <stdint.h>

#define REG8(address) (*(volatile uint8_t *)(uintptr_t)(address))
#define REG32(address) (*(volatile uint32_t *)(uintptr_t)(address))

/* Clocks: multipurpose clock generator, crystal oscillator, dividers and gates of the SIM. */
#define MCG_C1 REG8(0x40064000u)
#define MCG_C2 REG8(0x40064001u)
#define MCG_C5 REG8(0x40064004u)
#define MCG_C6 REG8(0x40064005u)
#define MCG_S REG8(0x40064006u)
#define OSC0_CR REG8(0x40065000u)
#define SIM_SOPT2 REG32(0x40048004u)
#define SIM_SCGC4 REG32(0x40048034u)
#define SIM_SCGC5 REG32(0x40048038u)
#define SIM_SCGC6 REG32(0x4004803Cu)
#define SIM_CLKDIV1 REG32(0x40048044u)

#define MCG_S_OSCINIT0 0x02u
#define MCG_S_CLKST 0x0Cu
#define MCG_S_CLKST_EXTERNAL 0x08u
#define MCG_S_CLKST_PLL 0x0Cu
#define MCG_S_IREFST 0x10u
#define MCG_S_PLLST 0x20u
#define MCG_S_LOCK0 0x40u

/* Unique id of the chip, 80 bits. */
#define SIM_UIDMH REG32(0x40048058u)
#define SIM_UIDML REG32(0x4004805Cu)
#define SIM_UIDL REG32(0x40048060u)

/* Watchdog ("computer operating properly"). COPC can be written once after a reset. */
#define SIM_COPC REG32(0x40048100u)
#define COP_256_MS 0x08u
#define SIM_SRVCOP REG32(0x40048104u)

/* Why the chip was reset. */
#define RCM_SRS0 REG8(0x4007F000u)
#define RCM_SRS1 REG8(0x4007F001u)
#define RCM_SRS0_LVD 0x02u
#define RCM_SRS0_LOC 0x04u
#define RCM_SRS0_LOL 0x08u
#define RCM_SRS0_WDOG 0x20u
#define RCM_SRS0_PIN 0x40u
#define RCM_SRS0_POR 0x80u
#define RCM_SRS1_LOCKUP 0x02u
#define RCM_SRS1_SW 0x04u

/* Power: where the supply is so low that the chip is reset, and where it only says so. The levels of the warning lie above
 * that of the reset: 1.8 to 2.1 V with the lower one, 2.7 to 3.0 V with the higher. */
#define PMC_LVDSC1 REG8(0x4007D000u)
#define PMC_LVDSC2 REG8(0x4007D001u)
#define PMC_LVDSC1_RESET 0x10u
#define PMC_LVDSC1_HIGH 0x01u /* 2.56 V instead of 1.6 V */
#define PMC_LVDSC2_FLAG 0x80u
#define PMC_LVDSC2_CLEAR 0x40u
#define PMC_LVDSC2_LEVEL(n) ((uint8_t)(n))
#define PMC_REGSC REG8(0x4007D002u)
#define PMC_REGSC_BANDGAP 0x01u /* for the converter */

/* Analogue to digital converter: whatever its channel has, in parts of the supply. */
#define ADC0_SC1A REG32(0x4003B000u)
#define ADC0_CFG1 REG32(0x4003B008u)
#define ADC0_RA REG32(0x4003B010u)
#define ADC0_SC3 REG32(0x4003B024u)
#define ADC_SC1_DONE 0x80u
#define ADC_CHANNEL_BANDGAP 27u
#define SIM_SCGC6_ADC0 0x08000000u

/* Flash is read through a small cache, which nobody else empties after a flash command. */
#define MCM_PLACR REG32(0xF000300Cu)
#define MCM_PLACR_CLEAR_CACHE 0x400u

/* Ports A..E are numbered 0..4. GPIO sits on the slow bus at 0x400FF000 and once more, single-cycle, at 0xF8000000. */
enum { PORT_A, PORT_B, PORT_C, PORT_D, PORT_E };

#define PORT_PCR(port, pin) REG32(0x40049000u + 0x1000u * (uint32_t)(port) + 4u * (uint32_t)(pin))
#define PORT_ISFR(port) REG32(0x400490A0u + 0x1000u * (uint32_t)(port))
#define GPIO_PSOR(port) REG32(0xF8000004u + 0x40u * (uint32_t)(port))
#define GPIO_PCOR(port) REG32(0xF8000008u + 0x40u * (uint32_t)(port))
#define GPIO_PDIR(port) REG32(0xF8000010u + 0x40u * (uint32_t)(port))
#define GPIO_PDDR(port) REG32(0xF8000014u + 0x40u * (uint32_t)(port))

#define PCR_PULL_UP 0x03u
#define PCR_MUX(n) ((uint32_t)(n) << 8)
#define PCR_GPIO PCR_MUX(1)
#define PCR_IRQ_FALLING (0xAu << 16)
#define PCR_IRQ_EITHER (0xBu << 16)

/* Timers 0..2. */
#define TPM_SC(n) REG32(0x40038000u + 0x1000u * (uint32_t)(n))
#define TPM_CNT(n) REG32(0x40038004u + 0x1000u * (uint32_t)(n))
#define TPM_MOD(n) REG32(0x40038008u + 0x1000u * (uint32_t)(n))
#define TPM_CSC(n, channel) REG32(0x4003800Cu + 0x1000u * (uint32_t)(n) + 8u * (uint32_t)(channel))
#define TPM_CV(n, channel) REG32(0x40038010u + 0x1000u * (uint32_t)(n) + 8u * (uint32_t)(channel))
#define TPM_SC_RUN 0x08u
#define TPM_CSC_PWM_HIGH 0x28u

/* SPI 0. */
#define SPI0_S REG8(0x40076000u)
#define SPI0_BR REG8(0x40076001u)
#define SPI0_C2 REG8(0x40076002u)
#define SPI0_C1 REG8(0x40076003u)
#define SPI0_DL REG8(0x40076006u)
#define SPI_S_SPTEF 0x20u
#define SPI_S_SPRF 0x80u
#define SPI_C1_SPE 0x40u
#define SPI_C1_MSTR 0x10u

/* Flash controller. */
#define FTFA_FSTAT REG8(0x40020000u)
#define FTFA_FCCOB0 REG8(0x40020007u)
#define FTFA_FCCOB1 REG8(0x40020006u)
#define FTFA_FCCOB2 REG8(0x40020005u)
#define FTFA_FCCOB3 REG8(0x40020004u)
#define FTFA_FCCOB4 REG8(0x4002000Bu)
#define FTFA_FCCOB5 REG8(0x4002000Au)
#define FTFA_FCCOB6 REG8(0x40020009u)
#define FTFA_FCCOB7 REG8(0x40020008u)
#define FTFA_FSTAT_CCIF 0x80u
#define FTFA_FSTAT_ERRORS 0x71u

/* The core: system timer, interrupt controller, reset. */
#define SYST_CSR REG32(0xE000E010u)
#define SYST_RVR REG32(0xE000E014u)
#define SYST_CVR REG32(0xE000E018u)
#define NVIC_ISER REG32(0xE000E100u)
#define SCB_AIRCR REG32(0xE000ED0Cu)
#define SCB_AIRCR_RESET 0x05FA0004u
#define SCB_SHPR3 REG32(0xE000ED20u)
#define IRQ_PORT_CD 31u

static inline void cpu_mask_interrupts(void) { __asm__ volatile("cpsid i" ::: "memory"); }
static inline void cpu_allow_interrupts(void) { __asm__ volatile("cpsie i" ::: "memory"); }
static inline void cpu_sleep(void) { __asm__ volatile("wfi" ::: "memory"); }

#endif
