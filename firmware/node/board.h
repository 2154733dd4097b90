/* What is wired to which pin of the Teensy LC; firmware/README.md has the same table. */
#ifndef BOARD_H
#define BOARD_H

#include "kl26.h"

/* Encoders: channels A and B of extrude, bias, translate on D0..D5 (pins 2/14, 7/8, 6/20), so that one read and one
 * interrupt serve all three. */
#define ENCODER_PORT PORT_D
#define ENCODER_PINS 0x3Fu

/* Motor drivers: two PWM inputs per motor, one sleep line and one fault line for all. */
#define NSLEEP_PORT PORT_D /* pin 5 */
#define NSLEEP_PIN 7
#define NFAULT_PORT PORT_D /* pin 21 */
#define NFAULT_PIN 6

/* Radio: SPI0 on C5 (clock, pin 13), C6 (out, 11), C7 (in, 12). */
#define CSN_PORT PORT_C /* pin 10 */
#define CSN_PIN 4
#define CE_PORT PORT_C /* pin 9 */
#define CE_PIN 3
#define RADIO_IRQ_PORT PORT_C /* pin 15 */
#define RADIO_IRQ_PIN 0

/* Switches close to ground. */
#define TRANSLATE_SWITCH_PORT PORT_B /* pin 18 */
#define TRANSLATE_SWITCH_PIN 3
#define ROD_SWITCH_PORT PORT_B /* pin 19 */
#define ROD_SWITCH_PIN 2
#define BUTTON_PORT PORT_E /* pin 24 */
#define BUTTON_PIN 20

/* Lamp: an LED with its resistor from pin 26 to ground. The LED on the board hangs on the radio's clock line. */
#define LAMP_PORT PORT_E
#define LAMP_PIN 30

#endif
