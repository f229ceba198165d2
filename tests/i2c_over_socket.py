"""An I2C bus that outlives the process on it: unmodified smbus2 in one process, emulated chips in another.

smbus2 touches the kernel by `os.open("/dev/i2c-N")` and `ioctl`. As a program, this file puts a Unix socket in the
place of both and runs another program above it: `python i2c_over_socket.py SOCKET MODULE [ARGUMENT]...`.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import runpy
import socket
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
            connection.send(json.dumps(_carried(bus, json.loads(request))).encode())


def _carried(bus: EmulatedI2cBus, messages: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the bytes of each message after the transaction, or the error number it ended with."""
    genuine = [
        i2c_msg.read(message["addr"], message["len"])
        if message["flags"] & I2C_M_RD
        else i2c_msg.write(message["addr"], bytes.fromhex(message["data"]))
        for message in messages
    ]
    try:
        bus.i2c_rdwr(*genuine)
    except OSError as error:
        return {"errno": error.errno}
    return {"data": [bytes(message).hex() for message in genuine]}


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
        asked = [
            {"addr": m.addr, "flags": m.flags, "len": m.len, "data": bytes(m.buf[: m.len]).hex()} for m in messages
        ]
        os.write(fd, json.dumps(asked).encode())
        answer = json.loads(os.read(fd, LONGEST))
        if "errno" in answer:
            raise OSError(answer["errno"], os.strerror(answer["errno"]))
        for message, data in zip(messages, answer["data"], strict=True):
            for index, value in enumerate(bytes.fromhex(data)):
                message.buf[index] = value
        return 0

    smbus2.smbus2.ioctl = ioctl
    smbus2.smbus2.os = types.SimpleNamespace(open=opened, close=os.close, O_RDWR=os.O_RDWR)


if __name__ == "__main__":
    stand_in_for_the_kernel(sys.argv[1])
    sys.argv = sys.argv[2:]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
