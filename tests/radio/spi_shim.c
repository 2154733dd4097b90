/* Stands between pyrf24 and the kernel: SPI and GPIO devices that are not there, and the clock of the model behind them.
 *
 * Preloaded, it answers open, ioctl and close for /dev/spidev* and /dev/gpiochip*, and lets sleeping and the monotonic
 * clock go by the model's time, once the test has installed its callbacks; before that, and for everything else, it is
 * not there.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/gpio.h>
#include <linux/spi/spidev.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

#define FILES 1024
#define LINES 54u
#define NS_PER_S 1000000000LL
#define NS_PER_US 1000LL

typedef void (*shim_transfer)(int csn, const uint8_t *sent, uint8_t *got, uint32_t length);
typedef void (*shim_line)(uint32_t line, int level);
typedef void (*shim_pass)(int64_t now_us);

enum kind { REAL, SPI, GPIO_CHIP, GPIO_LINE };

static struct {
    enum kind kind;
    uint32_t number; /* of the chip select or the line */
} files[FILES];

static struct {
    bool installed;
    shim_transfer transfer;
    shim_line line;
    shim_pass pass;
    const char *spi_file; /* real file behind an SPI device, which can be locked; NULL: there is no such device */
    const char *gpio_file;
    int64_t begin_ns;
    int64_t passed_ns;
    int64_t transfer_ns;
    int failures; /* transfers to come that fail */
    uint32_t header; /* number of the GPIO chip whose lines are wired */
    bool header_has_name;
    uint32_t speed_hz; /* of the last transfer */
} model;

static int (*real_open)(const char *, int, ...);
static int (*real_close)(int);
static int (*real_ioctl)(int, unsigned long, ...);
static int (*real_gettime)(clockid_t, struct timespec *);
static int (*real_sleep)(clockid_t, int, const struct timespec *, struct timespec *);

static void *find(const char *name) {
    return dlsym(RTLD_NEXT, name);
}

__attribute__((constructor)) static void begin(void) {
    *(void **)&real_open = find("open");
    *(void **)&real_close = find("close");
    *(void **)&real_ioctl = find("ioctl");
    *(void **)&real_gettime = find("clock_gettime");
    *(void **)&real_sleep = find("clock_nanosleep");
}

/* What the test calls. From here on the monotonic clock is the model's. */
void shim_install(shim_transfer transfer, shim_line line, shim_pass pass, int64_t transfer_ns) {
    struct timespec now;
    real_gettime(CLOCK_MONOTONIC, &now);
    model.transfer = transfer;
    model.line = line;
    model.pass = pass;
    model.transfer_ns = transfer_ns;
    model.header_has_name = false;
    if (!model.installed) {
        model.begin_ns = now.tv_sec * NS_PER_S + now.tv_nsec;
    }
    model.installed = true;
}

void shim_devices(const char *spi_file, const char *gpio_file) {
    model.spi_file = spi_file;
    model.gpio_file = gpio_file;
}

/* The board's header is GPIO chip so and so, and known by its label. */
void shim_header(uint32_t number) {
    model.header = number;
    model.header_has_name = true;
}

uint32_t shim_speed_hz(void) {
    return model.speed_hz;
}

int64_t shim_passed_us(void) {
    return model.passed_ns / NS_PER_US;
}

void shim_fail(int count) {
    model.failures = count;
}

static void pass(int64_t duration_ns) {
    if (duration_ns > 0) {
        model.passed_ns += duration_ns;
        model.pass(model.passed_ns / NS_PER_US);
    }
}

static int remember(int file, enum kind kind, uint32_t number) {
    if (file >= FILES) {
        real_close(file);
        errno = EMFILE;
        return -1;
    }
    if (file >= 0) {
        files[file].kind = kind;
        files[file].number = number;
    }
    return file;
}

static int open_backing(const char *backing) {
    if (backing == NULL) {
        errno = ENOENT;
        return -1;
    }
    return real_open(backing, O_RDWR | O_CLOEXEC);
}

static int open_any(const char *path, int flags, mode_t mode) {
    unsigned bus;
    unsigned select;
    if (model.installed && sscanf(path, "/dev/spidev%u.%u", &bus, &select) == 2) {
        return remember(open_backing(model.spi_file), SPI, bus * 10 + select);
    }
    if (model.installed && strncmp(path, "/dev/gpiochip", 13) == 0) {
        return remember(open_backing(model.gpio_file), GPIO_CHIP, (uint32_t)atoi(path + 13));
    }
    return real_open(path, flags, mode);
}

static mode_t mode_of(int flags, va_list rest) {
    return (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(rest, mode_t) : 0;
}

int open(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    mode_t mode = mode_of(flags, rest);
    va_end(rest);
    return open_any(path, flags, mode);
}

int open64(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    mode_t mode = mode_of(flags, rest);
    va_end(rest);
    return open_any(path, flags | O_LARGEFILE, mode);
}

int close(int file) {
    if (file >= 0 && file < FILES) {
        files[file].kind = REAL;
    }
    return real_close(file);
}

static int spi_ioctl(uint32_t csn, unsigned long request, void *argument) {
    const struct spi_ioc_transfer *message = argument;
    if (request != SPI_IOC_MESSAGE(1)) {
        return 0; /* mode, word size, speed: nothing to model */
    }
    if (model.failures > 0) {
        model.failures--;
        errno = EIO;
        return -1;
    }
    model.speed_hz = message->speed_hz;
    model.transfer((int)csn, (const uint8_t *)(uintptr_t)message->tx_buf, (uint8_t *)(uintptr_t)message->rx_buf,
                   message->len);
    pass(model.transfer_ns);
    return (int)message->len;
}

static int gpio_ioctl(int file, unsigned long request, void *argument) {
    if (request == GPIO_V2_GET_LINE_IOCTL) {
        struct gpio_v2_line_request *wanted = argument;
        wanted->fd = remember(open_backing(model.gpio_file), GPIO_LINE, wanted->offsets[0]);
        return wanted->fd < 0 ? -1 : 0;
    }
    if (request == GPIO_GET_CHIPINFO_IOCTL) {
        struct gpiochip_info *chip = argument;
        memset(chip, 0, sizeof *chip);
        chip->lines = LINES;
        bool is_header = model.header_has_name && files[file].number == model.header;
        strcpy(chip->label, is_header ? "pinctrl-rp1" : "gpio-brcmstb@107d508500");
    }
    if (request == GPIO_V2_LINE_SET_VALUES_IOCTL) {
        const struct gpio_v2_line_values *values = argument;
        model.line(files[file].number, (int)(values->bits & 1));
    }
    return 0; /* the direction of a line: nothing to model */
}

int ioctl(int file, unsigned long request, ...) {
    va_list rest;
    va_start(rest, request);
    void *argument = va_arg(rest, void *);
    va_end(rest);
    if (file < 0 || file >= FILES || files[file].kind == REAL) {
        return real_ioctl(file, request, argument);
    }
    return files[file].kind == SPI ? spi_ioctl(files[file].number, request, argument)
                                   : gpio_ioctl(file, request, argument);
}

static bool is_modelled(clockid_t clock) {
    return model.installed && (clock == CLOCK_MONOTONIC || clock == CLOCK_MONOTONIC_RAW || clock == CLOCK_BOOTTIME);
}

int clock_gettime(clockid_t clock, struct timespec *now) {
    if (!is_modelled(clock)) {
        return real_gettime(clock, now);
    }
    int64_t at_ns = model.begin_ns + model.passed_ns;
    now->tv_sec = at_ns / NS_PER_S;
    now->tv_nsec = at_ns % NS_PER_S;
    return 0;
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *wanted, struct timespec *left) {
    bool pauses = model.installed && (flags & TIMER_ABSTIME) == 0;
    if (!is_modelled(clock) && !pauses) {
        return real_sleep(clock, flags, wanted, left);
    }
    int64_t until_ns = wanted->tv_sec * NS_PER_S + wanted->tv_nsec;
    pass((flags & TIMER_ABSTIME) != 0 ? until_ns - model.begin_ns - model.passed_ns : until_ns);
    return 0;
}
