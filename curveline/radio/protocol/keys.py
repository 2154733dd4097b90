"""Keys of the link protocol, docs/radio-protocol.md: master key -> node key -> session key, and frame tags."""

from __future__ import annotations

from dataclasses import dataclass, field
from hashlib import blake2s

KEY_BYTES = 16
TAG_BYTES = 8
ZERO_MASTER = bytes(KEY_BYTES)
"""Master key of a site without a key file; good enough for a mock display only."""

FROM_HOST = b"H"
FROM_NODE = b"N"


def derive(key: bytes, label: bytes, *parts: bytes) -> bytes:
    """A 16-byte key out of `key`; the label keeps keys of different purposes apart, all parts have fixed sizes."""
    return blake2s(label + b"".join(parts), digest_size=KEY_BYTES, key=key).digest()


def tag(key: bytes, body: bytes, direction: bytes) -> bytes:
    """Tag of a frame body; the direction is bound in so that a frame cannot be reflected to its sender."""
    return blake2s(body + direction, digest_size=TAG_BYTES, key=key).digest()


OPEN_KEY = derive(ZERO_MASTER, b"page")
"""Key of frames that are no secret and no evidence: it only tells a whole frame from a damaged one."""


def session_key(node_key: bytes, host_nonce: int, node_nonce: tuple[int, int, int], run_tag: int) -> bytes:
    """Key of one session: fresh on both sides, and bound to the run; the node's nonce is its boot, offers, noise."""
    numbers = (part.to_bytes(4, "little") for part in node_nonce)
    return derive(node_key, b"session", host_nonce.to_bytes(8, "little"), *numbers, run_tag.to_bytes(8, "little"))


@dataclass(frozen=True)
class Site:
    """The master key of a lab and the chip ids of its nodes, in node order; the key never shows in a repr."""

    master: bytes = field(repr=False)
    chips: tuple[int, ...]

    def node_key(self, number: int) -> bytes:
        """Key of node `number` (from 1); a second chip on the same address has another one."""
        return derive(self.master, b"node", self.chips[number - 1].to_bytes(4, "little"))

    @property
    def stop_key(self) -> bytes:
        """Key of the broadcast STOP, the same for all nodes of the site."""
        return derive(self.master, b"stop")
