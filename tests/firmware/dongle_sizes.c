/* Lets a test reserve memory for what only C knows the size of. */
#include "dongle.h"
#include "sender.h"

size_t cl_dongle_size(void);
size_t cl_sender_size(void);

size_t cl_dongle_size(void) { return sizeof(cl_dongle); }

size_t cl_sender_size(void) { return sizeof(cl_sender); }
