"""How long a packet of the nRF24L01+ is in the air, and how often the chip sends it again by itself."""

from __future__ import annotations

RETRIES = 3
TURN_US = 130
"""Time in which a chip turns from sending to listening, or back."""
PACKET_BITS = 8 * (1 + 5 + 32 + 2) + 9
RATES_KBPS = {"250kbps": 250, "1Mbps": 1000, "2Mbps": 2000}
