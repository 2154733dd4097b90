/* Where a node keeps its settings: two flash sectors, so that there are old ones until the new ones have proved themselves.

   Duty: power may fail after any word, in one, and in the middle of an erase; a node then runs under the old settings or the
   new ones, whole.

   A sector: the record, then three marks of a word each, blank or set (0). REQUESTED: a host wants the record tried. TRIED: a
   boot has begun to. KEPT: a host has heard the node under it, or it was flashed. A mark whose programming was cut short reads
   as anything, perhaps as something else next time; it counts as set, and is set again.

   What a boot runs under: the newest whole record that is kept. One that is newer, requested and not tried goes before it,
   once, and only after the restart that the request makes: no power-on begins a trial, and one that finds a request marks it
   as tried. So nothing that a cut has half done shows up weeks later, not even a record whose erase was cut short so that it
   looks as if nobody had tried it.

   The sector of the settings in force is never erased, and the other one only if these are whole and their mark is not in
   doubt. Nothing is tried that was not written and read back since the last boot: the last word of a record may read well and
   yet not last.

   As with the store, call nothing here but `cl_settings_open` unless the motors are at rest. */
#ifndef CL_SETTINGS_STORE_H
#define CL_SETTINGS_STORE_H

#include "flash_hooks.h"
#include "settings_record.h"

typedef struct {
    cl_flash flash;
    uint32_t sector[2];
    cl_settings now;
    uint8_t at; /* sector of `now` */
    bool trial;
    bool stored; /* the next generation is in the other sector, written since the boot and not requested */
} cl_settings_store;

/* Find out what this boot runs under; false if there is nothing. `restarted`: the program has restarted itself. */
bool cl_settings_open(
    cl_settings_store *store, const cl_flash *flash, uint32_t first_sector, uint32_t second_sector, bool restarted
);

/* The next three return CL_OUTCOME_...: DONE, BEYOND if it makes no sense, FAILED if the flash did not take it. */

/* Write a record beside the present one; it must be a good one, of the next generation. */
uint8_t cl_settings_put(cl_settings_store *store, const uint8_t record[CL_SETTINGS_BYTES]);

/* The next boot is to try what was written in this one. */
uint8_t cl_settings_request(cl_settings_store *store);

/* What is on trial has proved itself. */
uint8_t cl_settings_keep(cl_settings_store *store);

/* Forget what was written. */
void cl_settings_forget(cl_settings_store *store);

#endif
