#!/usr/bin/env python3
"""The PC's side of ATI's RDT, written from reference/PROTOCOLS.md (section 2) alone, with the standard library alone.

It shares nothing with the Rust code. It asks the sensor at `address` for its stream, reads `cycles` samples, asks it to stop,
and prints one line of JSON.

    python3 rdt_client.py 127.0.0.1:49153 10000 [--counts-per-n 1000000] [--buffered]
"""

import argparse
import json
import socket
import struct
import sys

HEADER = 0x1234
STOP, START, START_BUFFERED = 0x0000, 0x0002, 0x0003
RECORD = struct.Struct(">III6i")
# A start is not acknowledged: a lost one shows only as silence.
RESEND_S = 0.1
SILENCE_S = 5.0
FIRST_SAMPLE_S = 60.0
HALF = 1 << 31


def request(command, count=0):
    return struct.pack(">HHI", HEADER, command, count)


class Stream:
    """What one sensor sent. Knows no socket."""

    def __init__(self, counts_per_n=1e6, counts_per_n_m=1e6):
        self.counts_per_n, self.counts_per_n_m = counts_per_n, counts_per_n_m
        self.samples = self.lost = self.duplicates = self.out_of_order = 0
        self.malformed = self.stalled = self.errors = 0
        self.first = self.last = self.ft = None
        self.first_ft = None
        self.force = None
        self.lowest, self.highest = [None] * 3, [None] * 3

    def datagram(self, data):
        """Takes one datagram: one record or, in buffered mode, up to forty."""
        if not data or len(data) % RECORD.size:
            self.malformed += 1
            return
        for fields in RECORD.iter_unpack(data):
            self._record(*fields)

    def _record(self, sequence, ft, status, *counts):
        if self.last is not None:
            ahead = (sequence - self.last) % (1 << 32)
            if ahead == 0:
                self.duplicates += 1
                return
            if ahead >= HALF:
                self.out_of_order += 1
                return
            self.lost += ahead - 1
        else:
            self.first, self.first_ft = sequence, ft
        if ft == self.ft:
            self.stalled += 1
        self.last, self.ft = sequence, ft
        self.samples += 1
        if status:
            self.errors += 1
        self.force = [value / self.counts_per_n for value in counts[:3]]
        self.torque = [value / self.counts_per_n_m for value in counts[3:]]
        for axis, value in enumerate(self.force):
            low, high = self.lowest[axis], self.highest[axis]
            self.lowest[axis] = value if low is None else min(low, value)
            self.highest[axis] = value if high is None else max(high, value)

    def summary(self):
        return {
            "samples": self.samples,
            "gaps": self.lost,
            "duplicates": self.duplicates,
            "out_of_order": self.out_of_order,
            "malformed": self.malformed,
            "stalled": self.stalled,
            "status_errors": self.errors,
            "first_sequence": self.first,
            "last_sequence": self.last,
            "first_ft": self.first_ft,
            "last_ft": self.ft,
            "force_n_min": self.lowest,
            "force_n_max": self.highest,
        }


def connect(address):
    host, _, port = address.rpartition(":")
    sensor = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sensor.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    sensor.connect((host, int(port)))
    return sensor


def read(sensor, stream, samples, command):
    """Reads until there are enough samples, or the sensor falls silent."""
    waited = 0.0
    sensor.send(request(command))
    sensor.settimeout(RESEND_S)
    while stream.samples < samples:
        try:
            stream.datagram(sensor.recv(65536))
            waited = 0.0
        except (socket.timeout, ConnectionRefusedError):
            waited += RESEND_S
            if waited > (FIRST_SAMPLE_S if stream.samples == 0 else SILENCE_S):
                break
            if stream.samples == 0:
                sensor.send(request(command))
    sensor.send(request(STOP))
    # Readings that are on their way still find their port open; they are no longer counted.
    sensor.settimeout(1.0)
    try:
        while sensor.recv(65536):
            pass
    except (socket.timeout, ConnectionRefusedError):
        pass


def main():
    parser = argparse.ArgumentParser(description="Reads an ATI Net F/T.")
    parser.add_argument("address")
    parser.add_argument("cycles", type=int)
    parser.add_argument("--counts-per-n", type=float, default=1e6)
    parser.add_argument("--counts-per-n-m", type=float, default=1e6)
    parser.add_argument("--buffered", action="store_true")
    given = parser.parse_args()
    stream = Stream(given.counts_per_n, given.counts_per_n_m)
    read(connect(given.address), stream, given.cycles, START_BUFFERED if given.buffered else START)
    print(json.dumps(stream.summary()), flush=True)
    return 0 if stream.samples >= given.cycles else 1


if __name__ == "__main__":
    sys.exit(main())
