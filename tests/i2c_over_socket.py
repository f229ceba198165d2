"""An I2C bus that outlives the process on it: unmodified smbus2 in one process, emulated chips in another.

smbus2 touches the kernel by `os.open("/dev/i2c-N")` and `ioctl`. As a program, this file puts a Unix socket in the
place of both and runs another program above it: `python i2c_over_socket.py SOCKET MODULE [ARGUMENT]...`. For a program
that is not Python's own, tests/rig/i2c_shim.c does the same below the C library.
"""

from __future__ import annotations

import contextlib
import errno
import os
import runpy
import socket
import struct
import sys
import threading
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import smbus2.smbus2
from smbus2 import i2c_msg

from device.simulation.chips.i2c_bus import I2C_M_RD, EmulatedI2cBus

I2C_FUNCS, I2C_RDWR = 0x0705, 0x0707
"""Requests of linux/i2c-dev.h."""
LONGEST = 65_536
COUNT, MESSAGE, ERROR = struct.Struct("<H"), struct.Struct("<HHH"), struct.Struct("<i")


@contextlib.contextmanager
def served(bus: EmulatedI2cBus, path: Path) -> Iterator[None]:
    """Carry the transactions of every process that opens the bus at a path."""
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    listening.bind(str(path))
    listening.listen()

    def accept() -> None:
        with contextlib.suppress(OSError):  # closed: the test is over
            while True:
                threading.Thread(target=_serve, args=(bus, listening.accept()[0]), daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    try:
        yield
    finally:
        listening.shutdown(socket.SHUT_RDWR)
        listening.close()


def _serve(bus: EmulatedI2cBus, connection: socket.socket) -> None:
    with connection, contextlib.suppress(ConnectionError):  # its process was killed in a transaction
        while request := connection.recv(LONGEST):
            connection.send(_carried(bus, request))


def _carried(bus: EmulatedI2cBus, request: bytes) -> bytes:
    """Return the error number of a transaction, 0 for none, and the bytes that were read.

    A request is the number of messages, then of each address, flags and length, and what it writes, if it does; all
    numbers are little-endian of 16 bits, the error's of 32.
    """
    (count,), at = COUNT.unpack_from(request), COUNT.size
    messages = []
    for _ in range(count):
        address, flags, length = MESSAGE.unpack_from(request, at)
        at += MESSAGE.size
        if flags & I2C_M_RD:
            messages.append(i2c_msg.read(address, length))
        else:
            messages.append(i2c_msg.write(address, request[at : at + length]))
            at += length
    try:
        bus.i2c_rdwr(*messages)
    except OSError as error:
        return ERROR.pack(error.errno)
    return ERROR.pack(0) + b"".join(bytes(message) for message in messages if message.flags & I2C_M_RD)


def stand_in_for_the_kernel(path: str) -> None:
    """Let smbus2 of this process open every bus at a socket."""

    def opened(_device: str, _flags: int) -> int:
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        connection.connect(path)
        return connection.detach()

    def ioctl(fd: int, request: int, argument: Any) -> int:
        if request == I2C_FUNCS:
            argument.value = 1  # plain I2C
            return 0
        if request != I2C_RDWR:
            raise OSError(errno.ENOTTY, os.strerror(errno.ENOTTY))
        messages = argument.msgs[: argument.nmsgs]
        os.write(fd, COUNT.pack(len(messages)) + b"".join(_packed(message) for message in messages))
        answer = os.read(fd, LONGEST)
        (error,), at = ERROR.unpack_from(answer), ERROR.size
        if error:
            raise OSError(error, os.strerror(error))
        for message in messages:
            if message.flags & I2C_M_RD:
                for index in range(message.len):
                    message.buf[index] = answer[at + index]
                at += message.len
        return 0

    smbus2.smbus2.ioctl = ioctl
    smbus2.smbus2.os = types.SimpleNamespace(open=opened, close=os.close, O_RDWR=os.O_RDWR)


def _packed(message: Any) -> bytes:
    head = MESSAGE.pack(message.addr, message.flags, message.len)
    return head if message.flags & I2C_M_RD else head + bytes(message.buf[: message.len])


if __name__ == "__main__":
    stand_in_for_the_kernel(sys.argv[1])
    sys.argv = sys.argv[2:]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
