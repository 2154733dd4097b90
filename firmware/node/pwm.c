/* Three motors on two DRV8833: 20 kHz, slow decay, asleep until the program says otherwise. */
#include "pwm.h"

#include "board.h"

/* 48 MHz / 2400 = 20 kHz. A channel value of PWM_FULL or more keeps the pin high all the time. */

typedef struct {
    uint8_t port, pin, mux, timer, channel;
} output;

/* Per motor: IN1, IN2. Pins 16/17, 3/4, 22/23. */
static const output outputs[3][2] = {
    {{PORT_B, 0, 3, 1, 0}, {PORT_B, 1, 3, 1, 1}},
    {{PORT_A, 1, 3, 2, 0}, {PORT_A, 2, 3, 2, 1}},
    {{PORT_C, 1, 4, 0, 0}, {PORT_C, 2, 4, 0, 1}},
};

void pwm_start(void) {
    pwm_sleep();
    PORT_PCR(NFAULT_PORT, NFAULT_PIN) = PCR_GPIO | PCR_PULL_UP;
    for (unsigned timer = 0; timer < 3; timer++) {
        TPM_SC(timer) = 0;
        TPM_CNT(timer) = 0;
        TPM_MOD(timer) = PWM_FULL - 1;
    }
    for (unsigned motor = 0; motor < 3; motor++) {
        for (unsigned side = 0; side < 2; side++) {
            const output *out = &outputs[motor][side];
            TPM_CSC(out->timer, out->channel) = TPM_CSC_PWM_HIGH;
            TPM_CV(out->timer, out->channel) = 0;
            PORT_PCR(out->port, out->pin) = PCR_MUX(out->mux);
        }
    }
    for (unsigned timer = 0; timer < 3; timer++) {
        TPM_SC(timer) = TPM_SC_RUN;
    }
}

/* Drive for `duty` of the time and short the motor for the rest: with the driving input high all the time, the other
 * one is low while driving. Zero is a shorted motor, which resists being turned. */
void pwm_set(unsigned motor, int32_t duty) {
    uint32_t size = (uint32_t)(duty < 0 ? -duty : duty);
    uint32_t low = PWM_FULL - (size > PWM_FULL ? PWM_FULL : size);
    const output *one = &outputs[motor][0];
    const output *two = &outputs[motor][1];
    TPM_CV(one->timer, one->channel) = duty < 0 ? low : PWM_FULL;
    TPM_CV(two->timer, two->channel) = duty < 0 ? PWM_FULL : low;
}

void pwm_release(unsigned motor) {
    for (unsigned side = 0; side < 2; side++) {
        TPM_CV(outputs[motor][side].timer, outputs[motor][side].channel) = 0;
    }
}

void pwm_sleep(void) {
    GPIO_PCOR(NSLEEP_PORT) = 1u << NSLEEP_PIN;
    GPIO_PDDR(NSLEEP_PORT) |= 1u << NSLEEP_PIN;
    PORT_PCR(NSLEEP_PORT, NSLEEP_PIN) = PCR_GPIO;
}

void pwm_wake(void) { GPIO_PSOR(NSLEEP_PORT) = 1u << NSLEEP_PIN; }

bool pwm_awake(void) { return (GPIO_PDIR(NSLEEP_PORT) >> NSLEEP_PIN & 1u) != 0; }

bool pwm_driver_fault(void) { return (GPIO_PDIR(NFAULT_PORT) >> NFAULT_PIN & 1u) == 0; }
