"""The rate of a running truerate: from its shared memory, a Unix socket or UDP. Python 3.8 or later, Linux, no package.

    import truerate
    with truerate.Shared("/dev/shm/truerate-1000-default") as rate:
        while (row := rate.wait(0.1)) is not truerate.ENDED:
            if row is not None and row.has(2):
                print(row.valid_ns, row.rate[2], row.rate_std[2])

The layout is that of docs/feed.md, version 1.
"""

import ctypes
import mmap
import os
import platform
import re
import socket
import struct
import time
from typing import NamedTuple, Optional, Tuple

VERSION = 1
STALE, END = 1, 2
PRESENT, HELD, LOST, OUTLIER, RESTARTED, CHANGED = 1, 2, 4, 8, 16, 32
ROW = struct.Struct("<4sHHQqQQQ9d3I4x")
HEAD = 128
ENDED = object()
"""What `Shared.wait` gives when the pipeline has ended."""

_FUTEX = {"x86_64": 202, "aarch64": 98, "riscv64": 98}.get(platform.machine())


class Row(NamedTuple):
    """The rate at one instant, rad/s; an axis that is not present has 0."""

    flags: int
    sequence: int
    valid_ns: int
    valid_clock_ns: int
    given_ns: int
    epoch: int
    rate: Tuple[float, float, float]
    rate_std: Tuple[float, float, float]
    rate_compensated: Tuple[float, float, float]
    axis_flags: Tuple[int, int, int]

    def has(self, axis: int) -> bool:
        """Whether this axis (0, 1, 2) has a rate that was read just now."""
        return self.axis_flags[axis] & (PRESENT | HELD) == PRESENT


def unpack(data: bytes) -> Row:
    """A row from its bytes, as they come by socket and UDP too."""
    magic, version, flags, *rest = ROW.unpack(data)
    if magic != b"TRTR" or version != VERSION:
        raise ValueError("no row of truerate, version %d" % VERSION)
    return Row(flags, *rest[:5], tuple(rest[5:8]), tuple(rest[8:11]), tuple(rest[11:14]), tuple(rest[14:17]))


class Shared:
    """The shared memory of `truerate run --out shm`."""

    def __init__(self, path: str):
        with open(path, "rb") as file:
            # In /dev/shm anyone may make a file: truerate-UID-… is to be that user's.
            owner = re.match(r"/dev/shm/truerate-(\d+)-", path)
            if owner and os.fstat(file.fileno()).st_uid != int(owner[1]):
                raise PermissionError(path + ": was made by another user")
            self._map = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        version, row, self._slots = struct.unpack_from("<3I", self._map, 8)
        if self._map[:8] != b"truerate" or version != VERSION or row != ROW.size:
            raise ValueError(path + ": no shared memory of truerate, version %d" % VERSION)
        self._seen = 0
        self._libc = ctypes.CDLL(None, use_errno=True) if _FUTEX else None
        # A read-only mapping has no address for ctypes: the kernel is given one of the same memory.
        self._word = _Word(path) if _FUTEX else None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._map.close()
        if self._word:
            self._word.close()

    def newest(self) -> Optional[Row]:
        """The newest row, where it is new."""
        while True:
            (written,) = struct.unpack_from("<Q", self._map, 40)
            if written == self._seen:
                return None
            at = HEAD + (written - 1) % self._slots * (8 + ROW.size)
            before = self._map[at : at + 8]
            data = self._map[at + 8 : at + 8 + ROW.size]
            # A slot's number is 0 while it is written.
            if before == self._map[at : at + 8] == struct.pack("<Q", written):
                self._seen = written
                return unpack(data)

    def wait(self, seconds: float):
        """The next newest row; None where none comes in time, ENDED where none comes any more."""
        until = time.monotonic() + seconds
        while True:
            state, word = struct.unpack_from("<2I", self._map, 32)
            row = self.newest()
            if row is not None:
                return row
            if state == 2:
                return ENDED
            left = until - time.monotonic()
            if left <= 0:
                return None
            if self._word:
                self._word.wait(self._libc, word, left)
            else:
                time.sleep(min(left, 0.0005))


class _Word:
    """The word that a row's writer wakes, mapped for the kernel."""

    def __init__(self, path: str):
        libc = ctypes.CDLL(None, use_errno=True)
        libc.mmap.restype = ctypes.c_void_p
        libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.c_long]
        libc.munmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t]
        file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        self._base = libc.mmap(None, HEAD, mmap.PROT_READ, mmap.MAP_SHARED, file, 0)
        os.close(file)
        if self._base == ctypes.c_void_p(-1).value:
            raise OSError(ctypes.get_errno(), path)
        self._munmap = libc.munmap

    def wait(self, libc, word: int, seconds: float):
        rest = struct.pack("@qq", int(seconds), int(seconds % 1 * 1e9))
        libc.syscall(
            ctypes.c_long(_FUTEX), ctypes.c_void_p(self._base + 36), ctypes.c_int(0), ctypes.c_uint32(word),
            ctypes.c_char_p(rest), ctypes.c_void_p(None), ctypes.c_int(0),
        )

    def close(self):
        self._munmap(self._base, HEAD)


def rows_of_socket(path: str):
    """Every row of `truerate run --out unix:PATH`, until it ends."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(path)
        with connection.makefile("rb") as stream:
            while len(data := stream.read(ROW.size)) == ROW.size:
                yield unpack(data)


def rows_of_udp(host: str, port: int):
    """Every row of `truerate run --out udp:HOST:PORT` that arrives here."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind((host, port))
        while True:
            yield unpack(receiver.recv(2048))
