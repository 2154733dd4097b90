/* What a node remembers while it has no power: where its axes stand, and how often it was switched on.

   Duty: a journal of 32-byte records in two flash sectors of 1 KB, written in turn. Power may fail after any word and
   in the middle of an erase; a reader then finds the newest whole record, or says that the position is unknown, but
   never takes a wrong position for good.
   Units: encoder counts; addresses in bytes.
   Source: a Teensy LC's flash is programmed by words of 32 bits, each once between two erases of its sector.

   Record, in words: magic with what its position was counted under, sequence, three positions, boot number and flags,
   mark, checksum of the first six. The checksum is programmed last. The mark stays blank until the axes are about to move: a record with its mark set
   still proves the boot number, but no position.

   Why a boot number never comes twice: it is used only after its record was written and read back; and a sector is
   erased only while the newest record lies, whole, in the other one. Even if the newest record should decay later, it
   counts: every complete but unreadable slot after the newest readable one raises the number by one more, and makes the
   position unknown. After the last of 2^24 - 1 numbers there is none any more. Only a new program, which erases the
   whole chip, begins at 1 again.

   A position belongs to the settings that it was counted under: they say where zero is. The program sums them up in 16
   bits; under others the boot number still counts, but no position. So nobody has to know what a loader erases.

   What it cannot know: axes turned by hand or by a load while the power is off.

   The processor stands still while its flash is busy (0.1 ms for a word, 0.1 s for a sector), and loses encoder edges:
   call nothing here but `cl_store_open` unless the motors are at rest. Then come `cl_store_tie` and `cl_store_boot`. */
#ifndef CL_STORE_H
#define CL_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "flash_hooks.h"
#include "motion.h"

enum {
    CL_STORE_WORDS = 8,                         /* of a record */
    CL_STORE_SLOTS = 1024 / 4 / CL_STORE_WORDS, /* of a sector */
    CL_STORE_SECTORS = 2,
    CL_STORE_NEAR = 8 /* counts: a resting encoder may tremble, and need not be written down each time */
};

typedef struct {
    cl_counts position;
    uint32_t boot;  /* 24 bits */
    uint8_t flags;  /* 7 bits of the program's own */
    bool known;     /* `position` is where the axes are */
    uint16_t under; /* which settings it was counted under */
} cl_saved;

typedef struct {
    cl_flash flash;
    uint32_t sector[CL_STORE_SECTORS];
    cl_saved last;
    uint16_t under; /* the settings of now */
    uint32_t sequence;
    uint32_t newest; /* address of the newest record; valid if `found` */
    uint8_t active;  /* sector that is being filled */
    uint8_t used;    /* slots of it that are no longer blank */
    uint8_t lost;    /* complete records that cannot be read, newer than `last` */
    bool found;
    bool marked;   /* the newest record no longer tells the position */
    bool prepared; /* the other sector was erased since power-on */
} cl_store;

/* Find the newest record; `store->last` is what it says, with `known` false if there is no certain position. */
void cl_store_open(cl_store *store, const cl_flash *flash, uint32_t first_sector, uint32_t second_sector);

/* From now on positions are counted under these settings; one that was counted under others is not known any more. */
void cl_store_tie(cl_store *store, uint16_t under);

/* Count this boot: `store->last.boot` is its number once this has returned true. Until then keep the radio silent. */
bool cl_store_boot(cl_store *store);

/* Write down where the resting axes are, or that nobody knows; what differs by no more than CL_STORE_NEAR is the same
   and costs nothing. What was written before is marked first: it is no longer true. */
bool cl_store_save(cl_store *store, const cl_counts *position, bool known, uint8_t flags);

/* The axes are about to move, for homing or for a step. If this fails they must not: a boot would believe the old
   position. */
bool cl_store_moving(cl_store *store);

/* Erase ahead, if the next save would have to: for a moment when nobody minds. */
bool cl_store_prepare(cl_store *store);

#endif
