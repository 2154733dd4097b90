/* Where what lies in a node's flash that has a loader, and what the loader knows of the program. docs/firmware-update.md has the
 * map; loader and programs of all releases agree on it. */
#ifndef LAYOUT_H
#define LAYOUT_H

#define PROGRAM_BEGIN 0x2800u
#define PROGRAM_END 0xEC00u
#define DESCRIPTION 0xEC00u /* a sector: the description, then the marks */
#define SECTOR_BYTES 1024u
#define SECTORS ((PROGRAM_END - PROGRAM_BEGIN) / SECTOR_BYTES)

/* Words of the description; `digest` is four. */
enum { WORD_SUM, WORD_DIGEST, WORD_LENGTH = 5, WORD_NUMBER, WORD_SETTINGS, DESCRIPTION_WORDS };

/* Marks are words. One that is not blank is set, also if its programming was cut short: it is begun when what it stands for
 * is done. The first ones are of the sectors of the program that are whole. */
#define MARKS (DESCRIPTION + 64u)
enum { MARK_WHOLE = 60, MARK_TRIED, MARK_KEPT };
#define MARK(number) (MARKS + 4u * (number))
#define BLANK_WORD 0xFFFFFFFFu

/* Which records of settings a program reads. */
#define SETTINGS_LAYOUT 1u

/* How a program asks for the loader before it resets the chip: the word and its inverse, in memory that neither uses. */
#define REQUEST 0x200017E8u
#define REQUEST_WORD 0x55504454u

#endif
