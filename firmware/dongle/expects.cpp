// What dongle.ino expects of Teensyduino, said so that a compiler checks it: `make -C firmware dongle` compiles this against
// the vendor's headers, and the tests against their stand-ins. Where both pass, the stand-ins tell the truth.
#include <Arduino.h>
#include <SPI.h>

template <typename One, typename Other> struct same {
    static constexpr bool value = false;
};
template <typename One> struct same<One, One> {
    static constexpr bool value = true;
};
#define GIVES(expression, type) static_assert(same<decltype(expression), type>::value, #expression)

static_assert(LOW == 0 && HIGH == 1 && OUTPUT == 1 && MSBFIRST == 1 && SPI_MODE0 == 0, "values of names");

extern void (*const set_mode)(uint8_t, uint8_t);
extern void (*const set_level)(uint8_t, uint8_t);
extern void (*const wait_us)(uint32_t);
extern uint32_t (*const time_us)();
extern uint32_t (*const time_ms)();
void (*const set_mode)(uint8_t, uint8_t) = pinMode;
void (*const set_level)(uint8_t, uint8_t) = digitalWrite;
void (*const wait_us)(uint32_t) = delayMicroseconds;
uint32_t (*const time_us)() = micros;
uint32_t (*const time_ms)() = millis;

GIVES(Serial.begin(115200), void);
GIVES(Serial.available(), int);
GIVES(Serial.read(), int);
GIVES(Serial.write(static_cast<const uint8_t *>(nullptr), size_t{1}), size_t);
GIVES(Serial.send_now(), void);
static_assert(static_cast<bool>(sizeof(Serial.dtr() ? 1 : 0)), "an open port is a condition");

GIVES(SPI.begin(), void);
GIVES(SPI.beginTransaction(SPISettings(uint32_t{8000000}, MSBFIRST, SPI_MODE0)), void);
GIVES(SPI.transfer(uint8_t{0}), uint8_t);
GIVES(SPI.endTransaction(), void);

#if defined(__IMXRT1062__)
GIVES((HW_OCOTP_CFG0), volatile uint32_t &);
GIVES((HW_OCOTP_CFG1), volatile uint32_t &);
#else
GIVES((SIM_UIDL), const uint32_t &);
GIVES((SIM_UIDML), const uint32_t &);
GIVES((SIM_UIDMH), const uint32_t &);
#if !defined(KINETISL)
GIVES((SIM_UIDH), const uint32_t &);
#endif
#endif
