"""The key file of a site: its master key and which device listens on which address; read with suspicion, kept private.

Nothing here ever shows the key: errors name the file and what is wrong with it, never what stands in it.
"""

from __future__ import annotations

import json
import os
import re
import secrets
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import Any

from curveline._version import __version__
from curveline.drive_settings import DriveSettings
from curveline.errors import InvalidInput
from curveline.notebook import html_of
from curveline.radio.protocol.keys import KEY_BYTES, ZERO_MASTER, Site, derive
from curveline.system import portable

MARKER = "curveline_site"
FORMAT = 2
UNCHECKED = 1
"""The format of older releases, which has no checksum; it stays readable, since nodes hold the keys in such files."""
CHECKSUM_BYTES = 8
SIZE_LIMIT = 1_000_000
PRIVATE = 0o600
UNKNOWN_CHIP = 0
"""Stands for the chip id of an address that was never adopted."""


class Lenient(Enum):
    """What a site may lack."""

    NOTHING = 0
    CHIPS = 1
    FILE = 2


_LENIENT: ContextVar[Lenient] = ContextVar("lenient", default=Lenient.NOTHING)
_AT_HAND: ContextVar[tuple[bytes, ...]] = ContextVar("at_hand", default=())


@dataclass(frozen=True)
class SiteFile:
    """What a key file says; `chips` by address in capital letters.

    A file of an older release has no checksum: damage in it may go unnoticed until `adopt` writes it anew.
    """

    path: Path  # of the file
    master: bytes = field(repr=False)  # the key itself, 16 bytes: never show it
    chips: Mapping[str, int] = field(default_factory=dict)
    has_checksum: bool = True  # against damage

    @property
    def fingerprint(self) -> str:
        """A short name of the master key that tells nothing about it."""
        return fingerprint_of(self.master)

    @property
    def remark(self) -> str:
        """What to do about a file of an older release; nothing about others."""
        if self.has_checksum:
            return ""
        command = "`curveline keys adopt --radio ... --display ...` writes it anew, with one"
        return f"{self.path} was written by an older release and has no checksum against damage: {command}"

    def rows(self) -> list[tuple[str, str]]:
        """Address and chip id, in hexadecimal digits, of every device that was adopted."""
        return [(address, f"{chip:08x}") for address, chip in sorted(self.chips.items())]

    def document(self) -> dict[str, Any]:
        """What is known as plain data, without the key."""
        head = {"curveline": __version__, "file": str(self.path), "fingerprint": self.fingerprint}
        return {**head, "chips": dict(self.rows())}

    def _repr_html_(self) -> str:
        return html_of(f"{self.path}: master key {self.fingerprint}", [("address", "chip"), *self.rows()])

    def site(self, drive: DriveSettings) -> Site:
        """Keys and chips of a display; InvalidInput if one of its nodes was never adopted."""
        missing = [address for address in drive.addresses if address.upper() not in self.chips]
        if missing and _LENIENT.get() is Lenient.NOTHING:
            raise unadopted(drive, missing, self.path)
        return Site(self.master, tuple(self.chips.get(address.upper(), UNKNOWN_CHIP) for address in drive.addresses))


def fingerprint_of(master: bytes) -> str:
    """A short name of a master key that tells nothing about it."""
    return derive(master, b"fingerprint")[:4].hex()


def default_path() -> Path:
    """Where the key file is: CURVELINE_KEYS, or curveline/site.json in XDG_CONFIG_HOME or ~/.config."""
    if chosen := os.environ.get("CURVELINE_KEYS"):
        return Path(chosen)
    config = os.environ.get("XDG_CONFIG_HOME")
    return (Path(config) if config else Path.home() / ".config") / "curveline" / "site.json"


def unadopted(drive: DriveSettings, addresses: Sequence[str], path: Path | None = None) -> InvalidInput:
    """What to raise for addresses of a display whose devices a key file, the usual one if None, does not know."""
    return InvalidInput(
        f"{path or default_path()} does not say which device listens on {', '.join(addresses)} of display "
        f"{drive.display!r}",
        hint="`curveline keys adopt --radio ... --display ...` asks the nodes, or some of them, and records them",
    )


def hardware_site(drive: DriveSettings) -> Site:
    """Keys of a display of real nodes; InvalidInput, with what to do, if there are none or not for all nodes."""
    path = default_path()
    if _LENIENT.get() is Lenient.FILE and not path.exists():
        return Site(ZERO_MASTER, (UNKNOWN_CHIP,) * drive.node_count)
    return read_site(path).site(drive)


@contextmanager
def lenient(*, without_file: bool = False) -> Iterator[None]:
    """Within this, radios open for nodes that nobody adopted, too, and on demand without a key file at all."""
    token = _LENIENT.set(Lenient.FILE if without_file else Lenient.CHIPS)
    try:
        yield
    finally:
        _LENIENT.reset(token)


@contextmanager
def at_hand(*masters: bytes) -> Iterator[None]:
    """Within this, mock displays are opened whose boards may hold these keys, too."""
    token = _AT_HAND.set(masters)
    try:
        yield
    finally:
        _AT_HAND.reset(token)


def keys_at_hand() -> tuple[bytes, ...]:
    """Master keys, besides that of the site, that boards of a mock display may hold."""
    return _AT_HAND.get()


def new_site(path: Path) -> SiteFile:
    """A new key file with a fresh master key, for its owner only; InvalidInput if there is a file already."""
    site = SiteFile(path, secrets.token_bytes(KEY_BYTES))
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        _create(path, site)
    except FileExistsError:
        hint = "nodes that hold its key would no longer be reached: move it away if you really want a new one"
        raise InvalidInput(f"{path} exists already and is not overwritten", hint) from None
    except (OSError, ValueError) as error:  # ValueError: a zero character in its name
        raise _refused(path, f"it cannot be written: {getattr(error, 'strerror', None) or error}") from None
    return site


def adopt(site: SiteFile, chips: Mapping[str, int]) -> SiteFile:
    """Record which devices listen on some addresses; the file is replaced whole or not at all.

    A device that was known on another address before has moved: a chip is in one place only. What others have recorded
    since `site` was read stays; InvalidInput if the file has another key by now.
    """
    path, master = site.path, site.master
    site = read_site(path)
    if site.master != master:
        message = (
            f"the key file {path} has been exchanged meanwhile, for one with another key: nothing is recorded in it"
        )
        raise InvalidInput(message, "see which of them the nodes hold; then begin anew")
    kept = {address: chip for address, chip in site.chips.items() if chip not in chips.values()}
    known = {**kept, **{address.upper(): chip for address, chip in chips.items()}}
    written = replace(site, chips=known, has_checksum=True)
    partial = site.path.with_name(f".{site.path.name}.{os.getpid()}.part")
    try:
        with suppress(FileNotFoundError):
            partial.unlink()
        _create(partial, written)
        portable.replace(partial, site.path)
    except OSError as error:
        raise _refused(site.path, f"it cannot be written: {error.strerror or error}") from None
    return written


def read_site(path: Path) -> SiteFile:
    """The key file at `path`; InvalidInput if there is none, if others may read it, or if it is damaged."""
    try:
        document = json.loads(_read_private(path).decode("utf-8"), object_pairs_hook=_unique)
        return SiteFile(path, *_checked(document))
    except RecursionError:
        raise _refused(path, "it is nested without end") from None
    except json.JSONDecodeError as error:
        raise _refused(path, f"it is not JSON, from line {error.lineno}, column {error.colno} on") from None
    except UnicodeDecodeError:
        raise _refused(path, "it is not text") from None
    except ValueError as error:
        raise _refused(path, str(error)) from None


def write_private(path: Path, data: bytes) -> None:
    """A new file that only its owner may read, on disk when this returns; OSError otherwise, and no half of it."""
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, PRIVATE)
    try:
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(data)
            stream.flush()
            portable.sync(descriptor)
    except BaseException:
        with suppress(OSError):
            path.unlink()
        raise


def _create(path: Path, site: SiteFile) -> None:
    nodes = dict(site.rows())
    checksum = _checksum(site.master, nodes)
    document = {MARKER: FORMAT, "master": site.master.hex(), "nodes": nodes, "checksum": checksum}
    write_private(path, json.dumps(document, indent=1).encode() + b"\n")


def _read_private(path: Path) -> bytes:
    """Bytes of a file that belongs to its reader alone; what is asked of it is asked of the open file."""
    try:
        descriptor = os.open(path, os.O_RDONLY | portable.NO_WAIT | portable.PLAIN)
    except (FileNotFoundError, NotADirectoryError):
        hint = "make keys with `curveline keys new`, then load them into the nodes; `--radio mock` needs none"
        raise InvalidInput(f"there is no key file {path}", hint) from None
    except (OSError, ValueError) as error:
        raise _refused(path, f"it cannot be read: {getattr(error, 'strerror', None) or error}") from None
    try:
        facts = os.fstat(descriptor)
        if not stat.S_ISREG(facts.st_mode):
            raise _refused(path, "it is no regular file")
        if portable.others_may_reach(facts.st_mode):
            hint = f"chmod 600 {path}; if others may have read it, make new keys and load them into the nodes"
            raise InvalidInput(f"the key file {path} can be read or changed by others, so it is not used", hint)
        data = os.read(descriptor, SIZE_LIMIT + 1)
    except OSError as error:
        raise _refused(path, f"it cannot be read: {error.strerror or error}") from None
    finally:
        os.close(descriptor)
    if len(data) > SIZE_LIMIT:
        raise _refused(path, "it is far too large")
    return data


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    record = dict(pairs)
    if len(record) < len(pairs):
        raise ValueError("it says something twice")
    return record


def _checksum(master: bytes, nodes: Mapping[str, str]) -> str:
    """What does not fit once anything in a key file is damaged.

    The master key is the key of the hash, as for everything else that is derived from it: to whoever has not the key
    these bytes are random, and no more of a help with guessing it than any frame on the air.
    """
    table = json.dumps(nodes, sort_keys=True, separators=(",", ":")).encode()
    return derive(master, b"key file", table)[:CHECKSUM_BYTES].hex()


def _checked(document: Any) -> tuple[bytes, Mapping[str, int], bool]:
    """Master key, chips, and whether a checksum vouches for them.

    ValueError says what is wrong, in words of ours only: the file holds a secret.
    """
    version = document.get(MARKER) if isinstance(document, dict) else None
    if type(version) is not int or version not in (UNCHECKED, FORMAT):
        raise ValueError(f"{MARKER} is not {FORMAT}")
    has_checksum = version == FORMAT
    if document.keys() != {MARKER, "master", "nodes"} | ({"checksum"} if has_checksum else set()):
        raise ValueError("it has missing or unknown entries")
    master, chips = _key_and_chips(document["master"], document["nodes"])
    if has_checksum and document["checksum"] != _checksum(master, document["nodes"]):
        raise ValueError("it is damaged: its checksum does not fit")
    return master, chips, has_checksum


def _key_and_chips(master: Any, nodes: Any) -> tuple[bytes, Mapping[str, int]]:
    if not isinstance(master, str) or re.fullmatch(r"[0-9a-f]{32}", master) is None:
        raise ValueError("its master key is not 32 hexadecimal digits")
    if master == ZERO_MASTER.hex():
        raise ValueError("its master key is nothing but zeros")
    if not isinstance(nodes, dict):
        raise ValueError("its nodes are no table of addresses")
    for address, chip in nodes.items():
        if re.fullmatch(r"[0-9A-F]{10}", address) is None:
            raise ValueError("an address is not ten hexadecimal digits in capitals")
        if not isinstance(chip, str) or re.fullmatch(r"[0-9a-f]{8}", chip) is None:
            raise ValueError(f"the chip id of {address} is not eight hexadecimal digits")
    chips = {address: int(chip, 16) for address, chip in nodes.items()}
    if len(set(chips.values())) < len(chips):
        raise ValueError("two addresses have the same chip id")
    return bytes.fromhex(master), chips


def _refused(path: Path, why: str) -> InvalidInput:
    hint = "restore it from a copy; without one, make new keys and load them into every node"
    return InvalidInput(f"the key file {path} is of no use: {why}", hint)
