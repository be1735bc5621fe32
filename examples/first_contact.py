"""First contact with a SAC: packets built by hand, sent through any serial port.

This needs nothing but pyserial, so it shows all there is to know about the wire. Start a bus in one
terminal and this in another:

    make serve
    python examples/first_contact.py /tmp/sacbus

A URL of pyserial's does as well, for a bus on TCP: socket://127.0.0.1:7000, or rfc2217://.

It sends a command to node 10, a damaged packet, a broadcast, and a command to nobody, and prints
what came back. Node 10's motor makes 400 full steps, two turns. The status is 0 when every answer
was the one expected, 1 when one was not, 2 when the port cannot be opened.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence

import serial

# The control characters that make a packet.
STX = 0x02  # begins it
ETX = 0x03  # ends its body
NUL = 0x00  # ends it
ACK = 0x06  # "received, and the CRC was right"
NAK = 0x15  # "received, but damaged"

EVERYBODY = 0  # all nodes obey a packet to address 0, and none of them answers
MOTHER = 1  # the address of the bus master: ours

NODE = 10  # make serve hosts nodes 10, 11 and 12 ...
NOBODY = 99  # ... and none with this address

# A node answers within 2 ms, and a packet takes some 4 ms at 38 400 baud. Patience costs nothing
# while an answer comes; silence is only known after waiting for it, so that wait is shorter.
PATIENCE = 2.0
SILENCE = 0.25


def crc8(body: bytes) -> int:
    """The check value of a packet: CRC-8 of Dallas/Maxim, over the body alone."""
    crc = 0
    for byte in body:
        crc ^= byte
        for _ in range(8):
            # The polynomial, 0x31, with its bits in reverse order: the lowest bit goes first.
            crc = crc >> 1 ^ 0x8C if crc & 1 else crc >> 1
    return crc


def packet(destination: int, body: bytes) -> bytes:
    """A packet from mother: STX, to, from, body, ETX, CRC, NUL. Nothing is escaped."""
    return bytes((STX, destination, MOTHER)) + body + bytes((ETX, crc8(body), NUL))


def answer(node: int, verdict: int) -> bytes:
    """What a node answers: STX, to, from, ACK or NAK. Four bytes, with no ETX, CRC or NUL."""
    return bytes((STX, MOTHER, node, verdict))


def exchange(port: serial.Serial, what: str, sent: bytes, expected: bytes) -> bool:
    """Send a packet, show what comes back, and say whether it was what was expected."""
    port.write(sent)
    port.timeout = PATIENCE if expected else SILENCE
    # For silence, ask for a byte all the same: one that comes would be one too many.
    heard = port.read(len(expected) or 1)
    right = heard == expected
    print(what)
    print(f"  sent   {sent.hex(' ')}")
    print(f"  heard  {heard.hex(' ') or 'nothing'}{'' if right else '   <-- not as expected'}")
    if not right:
        print(f"  wanted {expected.hex(' ') or 'nothing'}")
    # A node is deaf for half a millisecond after its answer, and after a broadcast.
    time.sleep(0.001)
    return right


def main(argv: Sequence[str]) -> int:
    """Make first contact through the port named in ``argv``; the exit status."""
    path = argv[0] if argv else "/tmp/sacbus"  # noqa: S108 (where make serve puts it)

    # m400 means: make 400 full steps.
    command = packet(NODE, b"m400")

    # The same, with one bit of its CRC wrong. This is how a node sees what the line has damaged,
    # so it does not move.
    damaged = bytearray(command)
    damaged[-2] ^= 0x10

    # The empty body does nothing, so it only asks whether somebody is there. Its CRC is 0.
    hello = packet(NODE, b"")

    # y releases every node that holds at a sync point; here none does, so nothing moves.
    broadcast = packet(EVERYBODY, b"y")

    try:
        # 8 data bits, no parity, 1 stop bit. Two readers of one serial port would share the
        # answers, so it is for us alone; a bus behind a URL is for everybody.
        alone = None if "://" in path else True
        port = serial.serial_for_url(path, 38_400, exclusive=alone)
    except serial.SerialException as fault:
        why = os.strerror(fault.errno) if fault.errno else fault
        print(f"error: cannot open the port ({why}), {path}, is the bus running?", file=sys.stderr)
        return 2
    with port:
        # What an earlier program left unread is no answer to us.
        port.reset_input_buffer()
        exchanges = (
            ("node 10, make 400 steps: it acknowledges", command, answer(NODE, ACK)),
            ("the same with a wrong CRC: it refuses", bytes(damaged), answer(NODE, NAK)),
            ("everybody, release sync: nobody answers a broadcast", broadcast, b""),
            ("node 99, which is not there: silence", packet(NOBODY, b"m400"), b""),
            ("node 10, nothing to do: it is still there", hello, answer(NODE, ACK)),
        )
        results = [exchange(port, *one) for one in exchanges]
    print("all as expected" if all(results) else f"{results.count(False)} not as expected")
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
