"""Stands for the interpreter: has a server's child do what it is asked to do, and ends as that ends."""

import json
import os
import resource
import signal
import socket
import struct
import sys

FORWARDED = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTTIN)
MOST = 100
"""Open files that are passed on at once."""


def is_open(descriptor: int) -> bool:
    """Whether there is a file; that in which they are listed is closed by then."""
    try:
        os.fstat(descriptor)
    except OSError:
        return False
    return True


def is_somewhere() -> bool:
    """Whether the current folder is there still."""
    try:
        os.getcwd()
    except OSError:
        return False
    return True


def is_for_the_interpreter(first: str = "-") -> bool:
    """Whether arguments begin with what only the interpreter itself knows: another option than `-c` and `-m`, or no."""
    return first.startswith("-") and first not in ("-c", "-m")


def circumstances() -> dict[str, object]:
    """What a process inherits besides its files, folder and environment."""
    umask = os.umask(0)
    os.umask(umask)
    limits = [getattr(resource, name) for name in dir(resource) if name.startswith("RLIMIT_")]
    return {
        "umask": umask,
        "limits": [(limit, resource.getrlimit(limit)) for limit in limits],
        "blocked": sorted(signal.pthread_sigmask(signal.SIG_BLOCK, [])),
        "heeded": [number for number in FORWARDED if signal.getsignal(number) != signal.SIG_IGN],
    }


def main() -> None:
    """Pass everything on, wait, end."""
    name, *arguments = sys.argv[1:]
    files = sorted(filter(is_open, map(int, os.listdir("/proc/self/fd"))))
    is_odd = is_for_the_interpreter(*arguments[:1]) or any(map(os.isatty, files))
    if is_odd or len(files) > MOST or not is_somewhere():
        os.execv(sys.executable, [sys.executable, *arguments])
    request = {"arguments": arguments, "folder": os.getcwd(), "environment": dict(os.environ), "files": files}
    request.update(circumstances())
    data = json.dumps(request).encode("ascii")
    signal.pthread_sigmask(signal.SIG_BLOCK, FORWARDED)
    with socket.socket(socket.AF_UNIX) as server:
        server.connect(f"\0{name}")
        socket.send_fds(server, [struct.pack("!I", len(data))], files)
        server.sendall(data)
        (process,) = struct.unpack("!i", server.recv(4, socket.MSG_WAITALL))
        for number in FORWARDED:
            signal.signal(number, lambda number, frame: os.kill(process, number))
        signal.pthread_sigmask(signal.SIG_SETMASK, request["blocked"])
        if not process:
            os.execv(sys.executable, [sys.executable, *arguments])
        (code,) = struct.unpack("!i", server.recv(4, socket.MSG_WAITALL))
    if code < 0:
        signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    os._exit(code)


main()
