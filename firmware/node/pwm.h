#ifndef PWM_H
#define PWM_H

#include <stdbool.h>
#include <stdint.h>

#define PWM_FULL 2400u

void pwm_start(void);
void pwm_set(unsigned motor, int32_t duty); /* -PWM_FULL .. PWM_FULL; 0 shorts the motor */
void pwm_release(unsigned motor);           /* let it turn freely */
void pwm_sleep(void);                       /* drivers off, motors free */
void pwm_wake(void);
bool pwm_awake(void);
bool pwm_driver_fault(void);

#endif
