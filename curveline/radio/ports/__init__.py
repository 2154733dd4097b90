"""Radios that exist: a dongle behind a serial port, a chip on the board."""
