"""Stands for the interpreter: has a server's child do what it is asked to do, and ends as that ends."""

import json
import os
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


def main() -> None:
    """Pass everything on, wait, end."""
    name, *arguments = sys.argv[1:]
    files = sorted(filter(is_open, map(int, os.listdir("/proc/self/fd"))))
    if len(files) > MOST or any(map(os.isatty, files)) or not is_somewhere():
        os.execv(sys.executable, [sys.executable, *arguments])
    request = {"arguments": arguments, "folder": os.getcwd(), "environment": dict(os.environ), "files": files}
    request["heeded"] = [number for number in FORWARDED if signal.getsignal(number) != signal.SIG_IGN]
    data = json.dumps(request).encode("ascii")
    signal.pthread_sigmask(signal.SIG_BLOCK, FORWARDED)
    with socket.socket(socket.AF_UNIX) as server:
        server.connect(f"\0{name}")
        socket.send_fds(server, [struct.pack("!I", len(data))], files)
        server.sendall(data)
        (process,) = struct.unpack("!i", server.recv(4, socket.MSG_WAITALL))
        for number in FORWARDED:
            signal.signal(number, lambda number, frame: os.kill(process, number))
        signal.pthread_sigmask(signal.SIG_UNBLOCK, FORWARDED)
        if not process:
            os.execv(sys.executable, [sys.executable, *arguments])
        (code,) = struct.unpack("!i", server.recv(4, socket.MSG_WAITALL))
    if code < 0:
        signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    os._exit(code)


main()
