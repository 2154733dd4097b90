/* What the parts of the loader call each other by. */
#ifndef LOADER_H
#define LOADER_H

/* main.c */
_Noreturn void loader_main(void);

#endif
