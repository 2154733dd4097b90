# `make updatable`: build/updatable.hex, the loader with the node program behind it. Written once by USB it makes a node whose
# program can be replaced over the air, with the same file.

LOADER := $(wildcard loader/*.c) $(addprefix node/,startup.c chip.c spi.c nrf24.c flash.c clock.c tick.c reset.c lamp.c libc/string.c) \
	$(addprefix core/,blake2s.c keys.c frames.c store.c crc32.c settings_record.c settings_store.c)
LOADER_OBJECTS := $(patsubst %.c,$(BUILD)/small/%.o,$(LOADER))
LOADER_LIMIT ?= 10240
LOADER_HEADERS := $(HEADERS) $(wildcard loader/*.h)

.PHONY: updatable
updatable: $(BUILD)/updatable.hex

$(BUILD)/updatable.hex: $(BUILD)/loader.elf $(BUILD)/program.elf loader/seal.py size.py
	@$(PYTHON) size.py $(BUILD)/loader.elf $(LOADER_LIMIT) 8192
	@$(PYTHON) size.py $(BUILD)/program.elf $(FLASH_LIMIT) $(RAM_LIMIT)
	@$(PYTHON) loader/seal.py $(BUILD)/loader.elf $(BUILD)/program.elf node/program.h $@
	@echo "wrote $@"

# The loader is made for size, the program for speed.
$(BUILD)/loader.elf: $(LOADER_OBJECTS) loader/loader.ld
	@echo "link $@"
	@$(ARM) $(ARM_FLAGS) -Os -nostartfiles -Wl,--gc-sections -Wl,-T,loader/loader.ld -Wl,-e,reset_handler $(LOADER_OBJECTS) $(ARM_LIBRARIES) -o $@

$(BUILD)/program.elf: $(OBJECTS) loader/program.ld
	@echo "link $@"
	@$(ARM) $(ARM_FLAGS) -nostartfiles -Wl,--gc-sections -Wl,-T,loader/program.ld -Wl,-e,reset_handler $(OBJECTS) $(ARM_LIBRARIES) -o $@

$(BUILD)/small/%.o: %.c $(LOADER_HEADERS) $(OPTIONS) Makefile loader/rules.mk | toolchain
	@mkdir -p $(@D)
	@echo "compile $< for size"
	@$(ARM) $(ARM_FLAGS) -Os $(COMMON) -c $< -o $@
