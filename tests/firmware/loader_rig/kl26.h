/* In place of the chip's registers: all that the loader's updating asks for is who the chip is. */
#ifndef KL26_H
#define KL26_H

#define SIM_UIDMH 0x00001234u
#define SIM_UIDML 0x89ABCDEFu
#define SIM_UIDL 0x01234567u

#endif
